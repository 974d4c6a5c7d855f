"""Refraction and Fresnel against vectors, amplitudes and traced light; densities against areas."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from arlight.errors import ProbeError
from arlight.optics import Slab, interface_reflectance

SLABS = [Slab(), Slab(1.0, 1.33), Slab(6.0, 1.9)]


def directions_of(seed, count, least_cosine=0.0):
    generator = np.random.default_rng(seed)
    cosine = generator.uniform(least_cosine, 1, count)
    azimuth = generator.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)


def refracted(incoming, normal, ratio):
    """Vector form of Snell's law: unit vectors into the denser side, ratio = n1/n2."""
    cosine = -(incoming @ normal)[:, None]
    return ratio * incoming + (ratio * cosine - np.sqrt(1 - ratio**2 * (1 - cosine**2))) * normal


def transmitted_at_face(cosine, first, second):
    """Unpolarised energy transmittance from first to second index, by the transmitted amplitudes."""
    other = np.sqrt(1 - (first / second) ** 2 * (1 - cosine**2))
    flux = second * other / (first * cosine)
    across = 2 * first * cosine / (first * cosine + second * other)
    along = 2 * first * cosine / (second * cosine + first * other)
    return 0.5 * flux * (across**2 + along**2)


@pytest.mark.parametrize("slab", SLABS)
def test_offset_is_where_a_refracted_ray_meets_the_film(slab):
    w = directions_of(0, 200)
    up = np.array([0.0, 0.0, 1.0])
    inside = refracted(-w, up, 1 / slab.refractive_index)
    np.testing.assert_allclose(np.linalg.norm(inside, axis=1), 1, atol=1e-12)
    travelled = inside * (slab.glass_mm / -inside[:, 2])[:, None]
    # from film to paper is -D
    np.testing.assert_allclose(slab.offset_mm(w), -travelled[:, :2], atol=1e-12)


@pytest.mark.parametrize("slab", SLABS)
def test_light_plane_is_a_disk_filled_up_to_the_horizon(slab):
    w = directions_of(1, 500)
    radius = np.linalg.norm(slab.light_plane(w), axis=1)
    assert radius.max() <= 0.5
    # farther from the normal is farther from the centre
    assert np.all(np.diff(radius[np.argsort(-w[:, 2])]) > 0)
    grazing = np.array([[1, 0, 0], [0, -1, 0], [0.6, 0.8, 0]])
    np.testing.assert_allclose(slab.light_plane(grazing), 0.5 * grazing[:, :2], atol=1e-15)
    np.testing.assert_allclose(slab.light_plane([0, 0, 1]), [0, 0], atol=1e-15)


@pytest.mark.parametrize("slab", SLABS)
def test_directions_invert_the_light_plane(slab):
    w = directions_of(2, 300, 1e-3).reshape(3, 100, 3)
    np.testing.assert_allclose(slab.directions(slab.light_plane(w)), w, atol=1e-9)
    generator = np.random.default_rng(3)
    delta = generator.uniform(-0.35, 0.35, (50, 2))
    np.testing.assert_allclose(slab.light_plane(slab.directions(delta)), delta, atol=1e-12)


def test_coordinates_outside_the_disk_are_the_horizon():
    w = Slab().directions([[0.9, 0], [0, -0.5000001], [3, 4]])
    np.testing.assert_allclose(w, [[1, 0, 0], [0, -1, 0], [0.6, 0.8, 0]], atol=1e-6)


def test_rounding_beyond_the_horizon_stays_finite():
    slab = Slab()
    w = np.array([1 + 1e-12, 0.0, -1e-12])
    assert np.linalg.norm(slab.light_plane(w)) == pytest.approx(0.5, abs=1e-9)
    assert slab.transmittance(w[2]) == 0
    assert np.all(np.isfinite(slab.received_weight([[0.5, 0.0], [0.5 + 1e-12, 0.0]])))


@pytest.mark.parametrize("slab", SLABS)
def test_turning_the_direction_turns_its_offset(slab):
    w = directions_of(4, 100)
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])
    np.testing.assert_allclose(slab.offset_mm(w @ turn.T), slab.offset_mm(w) @ turn[:2, :2].T, atol=1e-12)
    np.testing.assert_allclose(
        slab.received_weight(slab.light_plane(w @ turn.T)), slab.received_weight(slab.light_plane(w)), rtol=1e-9
    )


def test_thicker_glass_scales_the_offset_and_leaves_the_light_plane():
    w = directions_of(5, 50)
    thin, thick = Slab(1.0, 1.5), Slab(3.0, 1.5)
    np.testing.assert_allclose(thick.offset_mm(w), 3 * thin.offset_mm(w), rtol=1e-12)
    np.testing.assert_allclose(thick.light_plane(w), thin.light_plane(w), rtol=1e-12)


@pytest.mark.parametrize("index", [1.05, 1.33, 1.52, 2.4])
def test_a_face_neither_makes_nor_loses_light(index):
    cosine = np.linspace(1e-4, 1, 500)
    np.testing.assert_allclose(
        interface_reflectance(cosine, index), 1 - transmitted_at_face(cosine, 1.0, index), atol=1e-12
    )


@pytest.mark.parametrize(
    ("cosine", "index", "reflectance"),
    [
        (1.0, 1.5, 0.04),
        (1.0, 1.333, 0.02037),
        (np.cos(np.arctan(1.5)), 1.5, 0.5 * (1.25 / 3.25) ** 2),  # Brewster: only the component across is reflected
        (np.cos(np.radians(60)), 1.5, 0.0892),
        (0.0, 1.5, 1.0),
    ],
)
def test_known_reflectances(cosine, index, reflectance):
    assert interface_reflectance(cosine, index) == pytest.approx(reflectance, rel=1e-3)


@pytest.mark.parametrize("index", [1.33, 1.5, 1.9])
def test_diffuse_light_is_reflected_as_walsh_found(index):
    """Mean over the hemisphere against Walsh's closed form of 1926."""
    n = index
    walsh = (
        0.5
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * np.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * np.log(n)
    )
    share = (np.arange(200_000) + 0.5) / 200_000
    assert np.mean(interface_reflectance(np.sqrt(share), index)) == pytest.approx(walsh, rel=1e-4)


@pytest.mark.parametrize("slab", SLABS)
def test_light_thrown_to_and_fro_in_the_glass_adds_up_to_the_transmittance(slab):
    cosine = np.linspace(0.02, 1, 60)
    inside = np.sqrt(1 - (1 - cosine**2) / slab.refractive_index**2)
    enters = transmitted_at_face(cosine, 1.0, slab.refractive_index)
    leaves = transmitted_at_face(inside, slab.refractive_index, 1.0)
    down, through, back = enters, 0.0, 1 - enters
    for _ in range(2000):
        through, up = through + down * leaves, down * (1 - leaves)
        back, down = back + up * leaves, up * (1 - leaves)
    np.testing.assert_allclose(through + back, 1, atol=1e-9)
    np.testing.assert_allclose(slab.transmittance(cosine), through, rtol=1e-9)


@pytest.mark.parametrize("slab", SLABS)
def test_density_is_the_area_that_directions_cover_on_the_unit_disk(slab):
    """Projected solid angle is area of (w_x, w_y): a Jacobian by differences."""
    delta = np.random.default_rng(6).uniform(-0.33, 0.33, (200, 2))
    step = 1e-5
    columns = [
        (slab.directions(delta + shift)[:, :2] - slab.directions(delta - shift)[:, :2]) / (2 * step)
        for shift in step * np.eye(2)
    ]
    area = np.abs(np.linalg.det(np.stack(columns, axis=-1)))
    np.testing.assert_allclose(slab.projected_solid_angle_density(delta), area, rtol=1e-7)


@pytest.mark.parametrize("slab", SLABS)
def test_density_integrates_to_the_hemispheres_projected_solid_angle(slab):
    total, _ = dblquad(
        lambda y, x: float(slab.projected_solid_angle_density([x, y])),
        -0.5,
        0.5,
        lambda x: -np.sqrt(0.25 - x * x),
        lambda x: np.sqrt(0.25 - x * x),
        epsabs=1e-6,
    )
    assert total == pytest.approx(np.pi, abs=1e-5)


def test_nothing_is_received_from_the_rim_and_beyond():
    weight = Slab().received_weight([[0.5, 0.0], [0.0, -0.5], [0.4, 0.4], [0.0, 0.0]])
    np.testing.assert_allclose(weight[:3], 0, atol=1e-6)
    assert weight[3] > 1
    assert Slab().projected_solid_angle_density([[0.51, 0.0]]) == 0


@pytest.mark.parametrize("glass_mm", [0.0, -1.0, np.nan, np.inf])
def test_impossible_glass_is_refused(glass_mm):
    with pytest.raises(ProbeError, match="glass_mm"):
        Slab(glass_mm, 1.5)


@pytest.mark.parametrize("index", [1.0, 0.5, 4.5, np.nan])
def test_impossible_index_is_refused(index):
    with pytest.raises(ProbeError, match="refractive_index"):
        Slab(2.0, index)
