import numpy as np
import pytest
import trimesh

from arlight.estimation.radiance_prior import hemisphere_points
from arlight.fourier import pack_real
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.shadow import Darkening, PlaneGrid, PlaneShadow
from arlight.rendering.transfer import precompute_transfer
from arlight.synthetic.captured import load_environment

pytestmark = pytest.mark.usefixtures("gl")

RADIUS_MM, HEIGHT_MM = 4.0, 40.0


def hidden_by_post(points, directions):
    """Whether rays from points (p, 2) of the plane along directions (d, 3) meet the post, in closed form (p, d)."""
    across = np.linalg.norm(directions[:, :2], axis=1)
    heading = directions[:, :2] / np.maximum(across, 1e-12)[:, None]
    b = points @ heading.T
    inside = b**2 - (np.sum(points**2, axis=1)[:, None] - RADIUS_MM**2)
    entry = -b - np.sqrt(np.maximum(inside, 0.0))
    return (inside > 0) & (entry > 0) & (entry * directions[:, 2] / np.maximum(across, 1e-12) < HEIGHT_MM)


@pytest.fixture(scope="module")
def post(reconstruction):
    mesh = from_trimesh(trimesh.creation.cylinder(RADIUS_MM, HEIGHT_MM, sections=64)).placed(HEIGHT_MM)
    return precompute_transfer(mesh, reconstruction).shadow


@pytest.fixture(scope="module")
def places(post):
    """Texels (s,) clear of the post and of the map's faded margin, and their points (s, 2)."""
    points = post.grid.texel_centres_mm()[:, :2]
    reach = post.grid.texel_mm * post.grid.side / 2.0
    chosen = (np.linalg.norm(points, axis=1) > RADIUS_MM + 2.0) & (np.abs(points).max(axis=1) < 0.64 * reach)
    chosen = np.flatnonzero(chosen)[::17]
    return chosen, points[chosen]


@pytest.mark.parametrize("name", ["apartment", "hall"])
def test_shadow_of_a_post_is_the_integral_over_the_reconstructed_light(post, places, reconstruction, probe, name):
    texels, points = places
    packed = pack_real(load_environment(name).rotated(0.7).coefficients(probe.slab, probe.frequencies))
    w = hemisphere_points(6000)
    light = w[:, 2:] * (reconstruction.radiance_rows(w) @ packed)
    expected = 1.0 - hidden_by_post(points, w).astype(float) @ light / light.sum(axis=0)
    found = post.ratio(packed).reshape(-1, 3)[texels]
    assert expected.min() < 0.7
    assert np.abs(found - np.clip(expected, 0, 1)).max() < 0.015


def test_shadow_of_a_post_is_the_integral_over_the_captured_environment(post, places, probe):
    """What a sheet's few coefficients leave of the environment itself: within 3 % of the unshadowed irradiance."""
    texels, points = places
    environment = load_environment("apartment").rotated(0.7)
    directions, light = environment.samples()
    light = light * directions[:, 2:]
    expected = 1.0 - hidden_by_post(points, directions).astype(float) @ light / light.sum(axis=0)
    found = post.ratio(pack_real(environment.coefficients(probe.slab, probe.frequencies))).reshape(-1, 3)[texels]
    error = np.abs(found - expected)
    assert np.sqrt(np.mean(error**2)) < 0.015
    assert np.quantile(error, 0.95) < 0.03


def test_ratio_does_not_depend_on_the_light_s_strength(post, environment, probe):
    packed = pack_real(environment.coefficients(probe.slab, probe.frequencies))
    assert np.allclose(post.ratio(packed), post.ratio(50.0 * packed), atol=1e-5)


def test_what_is_hidden_is_linear_in_the_light(post, probe):
    one, other = (
        pack_real(load_environment(n).coefficients(probe.slab, probe.frequencies)) for n in ("apartment", "bridge")
    )
    lost = [(1.0 - post.ratio(packed)) * (post.open_row @ packed) for packed in (one, other, 2.0 * one + other)]
    kept = (lost[0] > 1e-3) & (lost[1] > 1e-3)  # where no clipping to [0, 1] acted
    assert kept.mean() > 0.2
    assert np.allclose(lost[2][kept], (2.0 * lost[0] + lost[1])[kept], rtol=1e-3, atol=1e-4)


def test_darkness_stays_defined(post, probe):
    k = 2 * len(probe.frequencies) - 1
    assert np.all(post.ratio(np.zeros((k, 3))) == 1.0)
    assert np.all(np.isfinite(post.ratio(-np.ones((k, 3)))))


def test_the_map_s_rim_is_not_shadowed(post, environment, probe):
    ratio = post.ratio(pack_real(environment.coefficients(probe.slab, probe.frequencies)))
    rim = np.concatenate([ratio[0], ratio[-1], ratio[:, 0], ratio[:, -1]])
    assert np.all(rim == 1.0)


def test_texels_know_their_places():
    grid = PlaneGrid((-3.0, 5.0), 0.5, 8)
    numbers = grid.texel_of(grid.texel_centres_mm()).reshape(8, 8, 2)
    assert np.allclose(numbers[3, 6], [6.0, 3.0])
    assert np.allclose(grid.texel_centres_mm()[0], [-2.75, 5.25, 0.0])


def test_openness_is_looked_up_where_a_falling_ray_lands():
    grid = PlaneGrid((0.0, 0.0), 1.0, 4)
    openness = np.arange(16, dtype=np.float32).reshape(4, 4) / 16
    shadow = PlaneShadow(grid, np.zeros((16, 1), np.float32), np.ones(1, np.float32), openness)
    slanted = np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0)
    found = shadow.openness_along(np.array([[0.5, 2.5, 2.0], [3.5, 0.5, 0.0], [3.5, 0.5, 9.0]]), slanted)
    assert np.allclose(found, [openness[2, 2], openness[0, 3], 1.0])


def test_faint_darkening_fades_to_nothing_without_a_step():
    darkening = np.linspace(0.0, 0.1, 45 * 45).astype(np.float32)
    hidden = darkening[:, None] * np.array([2.0, 0.5, 0.0, 0.0], np.float32)
    ratio = Darkening(PlaneGrid((0.0, 0.0), 1.0, 45), 0.01).ratio(hidden, np.array([2.0, 1.0, 1.0]))
    left = 1.0 - ratio.reshape(-1, 4)
    assert np.all(left[darkening < 0.0099] == 0.0)
    strong = darkening > 0.0201
    np.testing.assert_allclose(left[strong, 0], darkening[strong], atol=1e-6)
    np.testing.assert_allclose(left[strong, 1], 0.5 * darkening[strong], atol=1e-6)
    assert np.all(left[:, 2] == 0.0)
    assert np.array_equal(left[:, 3], left[:, :3].max(axis=1))
    assert np.all(np.diff(left[:, 0]) >= -1e-6)
    assert np.max(np.diff(left[:, 0])) < 4.0 * np.diff(darkening).max()
    assert np.all(np.abs(left[:, 0] - darkening) <= 0.01 + 1e-6)


@pytest.mark.parametrize(("columns", "rows"), [((2, 5), (1, 1)), ((0, 0), (0, 7)), ((0, 7), (3, 7))])
def test_the_outline_is_that_of_what_darkened_texels_reach(columns, rows):
    grid = PlaneGrid((-3.0, 5.0), 0.5, 8)
    hidden = np.zeros((8, 8, 4), np.float32)
    hidden[rows[0], columns[0], 1] = hidden[rows[1], columns[1], 2] = 0.5
    darkening = Darkening(grid, 0.01)
    darkening.ratio(hidden.reshape(64, 4), np.ones(3))
    corners = grid.texel_of(darkening.outline_mm())
    assert np.allclose(corners.min(axis=0), [columns[0] - 1.0, rows[0] - 1.0])
    assert np.allclose(corners.max(axis=0), [columns[1] + 1.0, rows[1] + 1.0])
    assert len(np.unique(corners.round(6), axis=0)) == 32


@pytest.mark.parametrize("lost", [0.0, 0.009, -1.0, np.nan])
def test_what_is_hardly_darkened_has_no_outline(lost):
    darkening = Darkening(PlaneGrid((0.0, 0.0), 1.0, 4), 0.01)
    assert np.all(darkening.ratio(np.full((16, 4), lost, np.float32), np.ones(3)) == 1.0)
    assert darkening.outline_mm() is None


def test_what_is_hidden_of_other_texels_is_refused():
    with pytest.raises(ValueError, match="16"):
        Darkening(PlaneGrid((0.0, 0.0), 1.0, 4)).ratio(np.zeros((9, 4), np.float32), np.ones(3))
