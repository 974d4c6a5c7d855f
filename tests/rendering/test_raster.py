"""The compiled renderer: what it covers, whatever it is given, and that OpenGL draws the same."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import Delaunay

from arlight.camera import Pose
from arlight.color import linear_from_encoded
from arlight.rendering.default_object import default_object
from arlight.rendering.draw import ObjectRenderer
from arlight.rendering.gloss import GLOSS_SIDE, gloss_rows
from arlight.rendering.mesh import Mesh
from arlight.rendering.projection import View, project
from arlight.rendering.raster import RasterRenderer
from arlight.rendering.refinement import refined
from arlight.rendering.shadow import PlaneGrid, PlaneShadow
from arlight.rendering.transfer import Transfer, precompute_transfer
from arlight.video.frame import Region

WHITE = np.ones((1, 3), np.float32)


def matte_renderer(mesh, radiance, supersampling=1):
    """Every vertex has its own radiance under unit light, and no gloss."""
    n = len(mesh.vertices_mm)
    grid = PlaneGrid((0.0, 0.0), 1.0, 2)
    shadow = PlaneShadow(grid, np.zeros((4, 1), np.float32), np.ones(1, np.float32), np.ones((2, 2), np.float32))
    rows = np.broadcast_to(np.asarray(radiance, np.float32), n)[:, None].copy()
    transfer = Transfer(rows, np.zeros((n, 9), np.float32), shadow)
    return RasterRenderer(mesh, transfer, np.zeros((GLOSS_SIDE**2, 1), np.float32), 0.5, 0.0, supersampling)


def flat_mesh(places, faces, height_mm=0.0):
    """White triangles at (x, y) on a plane, counter-clockwise from above."""
    vertices = np.column_stack([places, np.full(len(places), height_mm)])
    corners = vertices[faces][..., :2]
    side, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0] < 0.0
    faces = np.where(clockwise[:, None], faces[:, ::-1], faces).astype(np.int32)
    normals = np.tile([0.0, 0.0, 1.0], (len(places), 1))
    return Mesh(vertices, normals, faces, np.ones((len(places), 3), np.float32), closed=True)


def drawn(renderer, mesh, camera, pose, light=WHITE, region=None):
    projected = project(camera, pose, mesh.vertices_mm)
    view = View(pose, projected, region or projected.region())
    return renderer.draw(view, light).copy()


@pytest.mark.parametrize("seed", range(4))
def test_triangles_that_share_edges_cover_every_sample_once(camera, looking_down, seed):
    """Drawn one at a time they add up to what they cover together: no crack, and no sample twice."""
    rng = np.random.default_rng(seed)
    # on whole and half pixels too, where edges run through samples
    places = np.concatenate(
        [rng.uniform(-30, 30, (40, 2)), rng.integers(-30, 30, (25, 2)) * 1.0, [[-40, -40], [40, 40]]]
    )
    places = np.unique(places, axis=0)
    faces = Delaunay(places).simplices
    mesh, pose = flat_mesh(places, faces), looking_down(0.0, 300.0)
    region = project(camera, pose, mesh.vertices_mm).region()
    total = sum(
        drawn(matte_renderer(part, 1.0), part, camera, pose, region=region)[..., 3]
        for part in (replace(mesh, faces=face[None]) for face in mesh.faces)
    )
    together = drawn(matte_renderer(mesh, 1.0), mesh, camera, pose, region=region)[..., 3]
    assert np.array_equal(total, together)
    # within the hull, its rim aside, nothing is missing
    y, x = np.mgrid[region.y0 : region.y1, region.x0 : region.x1]
    pixels = project(camera, pose, mesh.vertices_mm).pixels
    hull = Delaunay(pixels.mean(axis=0) + 0.99 * (pixels - pixels.mean(axis=0)))
    assert np.all(together[hull.find_simplex(np.stack([x, y], axis=-1)) >= 0] == 1.0)


def test_radiance_is_interpolated_in_perspective(camera, looking_down):
    """A long card seen at a slant: radiance that is linear in space is so along the card, not along the picture."""
    places = np.array([[-10.0, -60.0], [10.0, -60.0], [10.0, 60.0], [-10.0, 60.0]])
    mesh, pose = flat_mesh(places, np.array([[0, 1, 2], [0, 2, 3]])), looking_down(60.0, 200.0)
    image = drawn(matte_renderer(mesh, (places[:, 1] + 100.0) / 100.0), mesh, camera, pose)
    region = project(camera, pose, mesh.vertices_mm).region()
    for y_mm in (-50.0, -20.0, 0.0, 30.0, 50.0):
        x, y = np.rint(camera.project(pose, [[0.0, y_mm, 0.0]])[0]).astype(int)
        toward = pose.rotation.T @ [*camera.rays([[x, y]])[0], 1.0]
        seen = pose.camera_centre_mm - toward * pose.camera_centre_mm[2] / toward[2]
        assert image[y - region.y0, x - region.x0, 0] == pytest.approx((seen[1] + 100.0) / 100.0, rel=1e-3)


@pytest.mark.usefixtures("gl")
@pytest.mark.parametrize("which", ["camera", "lens_camera"])
def test_opengl_draws_the_same(request, which, pose, reconstruction):
    """Coverage to the sample, radiance but for the gloss, which OpenGL works out for every pixel."""
    camera = request.getfixturevalue(which)
    mesh = default_object(6000).placed(60.0)
    transfer = precompute_transfer(mesh, reconstruction, 96, 32)
    packed = np.asarray(np.random.default_rng(1).uniform(0.0, 0.1, (81, 3)), np.float32)
    packed[0] = [1.0, 0.8, 0.5]
    material = (gloss_rows(reconstruction, 0.4), 0.4, 0.04, 2)
    views = [
        drawn(kind(mesh, transfer, *material), mesh, camera, pose, packed) for kind in (RasterRenderer, ObjectRenderer)
    ]
    ours, theirs = views
    assert np.mean(ours[..., 3] != theirs[..., 3]) < 1e-3
    assert np.abs(ours - theirs)[..., :3].mean() < 0.01 * theirs[..., :3].mean()


@pytest.mark.parametrize("faces", [60, 2000])
@pytest.mark.parametrize("supersampling", [1, 2, 3])
def test_the_height_of_bands_does_not_matter(camera, pose, monkeypatch, faces, supersampling):
    """Also where large faces go on through many bands."""
    mesh = default_object(faces).placed(60.0)
    radiance = np.random.default_rng(6).permutation(len(mesh.vertices_mm)) + 1.0
    pictures = []
    for samples in (1, 3000, 1 << 30):
        monkeypatch.setattr("arlight.rendering.raster._BAND_SAMPLES", samples)
        pictures.append(drawn(matte_renderer(mesh, radiance, supersampling), mesh, camera, pose))
    assert pictures[0][..., 3].any()
    assert np.array_equal(pictures[0], pictures[2])
    assert np.array_equal(pictures[1], pictures[2])


@pytest.mark.parametrize("band_samples", [1, 1000, 1 << 30])
def test_of_faces_at_one_depth_the_first_stays(camera, looking_down, monkeypatch, band_samples):
    monkeypatch.setattr("arlight.rendering.raster._BAND_SAMPLES", band_samples)
    rng, pose = np.random.default_rng(9), looking_down(0.0, 300.0)
    mesh = flat_mesh(rng.uniform(-30, 30, (60, 2)), np.arange(60).reshape(20, 3))
    region = project(camera, pose, mesh.vertices_mm).region()
    together = drawn(matte_renderer(mesh, np.repeat(np.arange(20) + 1.0, 3)), mesh, camera, pose, region=region)
    expected = np.zeros(together.shape[:2])
    for i, face in enumerate(mesh.faces):
        alone = drawn(matte_renderer(replace(mesh, faces=face[None]), 1.0), mesh, camera, pose, region=region)[..., 3]
        expected = np.where((expected == 0.0) & (alone > 0.0), i + 1.0, expected)
    assert len(np.unique(expected)) > 8
    np.testing.assert_allclose(together[..., 0], expected, rtol=1e-5)


def test_what_reaches_behind_the_camera_is_left_out_and_the_rest_drawn(camera, pose):
    near, far = default_object(400).placed(40.0), default_object(400).placed(40.0)
    behind = replace(near, vertices_mm=near.vertices_mm + pose.camera_centre_mm * 1.3)
    both = replace(
        far,
        vertices_mm=np.concatenate([far.vertices_mm, behind.vertices_mm]),
        normals=np.concatenate([far.normals, behind.normals]),
        faces=np.concatenate([far.faces, behind.faces + len(far.vertices_mm)]),
        base_colour=np.concatenate([far.base_colour, behind.base_colour]),
    )
    region = Region(0, 0, 320, 240)
    expected = drawn(matte_renderer(far, 1.0), far, camera, pose, region=region)
    assert expected[..., 3].any()
    assert np.array_equal(drawn(matte_renderer(both, 1.0), both, camera, pose), expected)


@pytest.mark.filterwarnings("ignore:invalid value encountered in matmul")
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e18])
def test_impossible_poses_draw_nothing(camera, pose, bad):
    mesh = default_object(400).placed(40.0)
    for broken in (Pose(pose.rotation, np.array([bad, 0.0, 300.0])), Pose(np.full((3, 3), bad), pose.translation)):
        image = drawn(matte_renderer(mesh, 1.0), mesh, camera, broken, region=Region(10, 20, 70, 60))
        assert not image.any()


def test_finer_triangles_than_samples_leave_no_hole(camera, looking_down):
    """Thousands of triangles to a pixel, seen from far away."""
    mesh, pose = default_object(9000).placed(20.0), looking_down(30.0, 3000.0)
    image = drawn(matte_renderer(mesh, 1.0, 4), mesh, camera, pose)
    coarse = default_object(9000).placed(20.0)
    enclosed = drawn(matte_renderer(coarse, 1.0, 16), coarse, camera, pose)
    assert image[..., 3].sum() == pytest.approx(enclosed[..., 3].sum(), rel=0.1)
    assert 0.0 < image[..., 3].max() <= 1.0


def test_a_refined_mesh_is_lit_by_its_coarse_vertices(camera, pose):
    mesh = default_object(2000).placed(60.0)
    finer = refined(mesh)
    lit = np.linspace(0.5, 1.5, len(mesh.vertices_mm)).astype(np.float32)
    both = []
    for refinement, object_ in ((finer, mesh), (None, finer.mesh)):
        renderer = matte_renderer(object_, lit if refinement else finer.carried(lit), 2)
        if refinement is not None:
            rows = lit[:, None]
            grid = PlaneGrid((0.0, 0.0), 1.0, 2)
            shadow = PlaneShadow(
                grid, np.zeros((4, 1), np.float32), np.ones(1, np.float32), np.ones((2, 2), np.float32)
            )
            transfer = Transfer(rows, np.zeros((len(lit), 9), np.float32), shadow)
            nothing = np.zeros((GLOSS_SIDE**2, 1), np.float32)
            renderer = RasterRenderer(mesh, transfer, nothing, 0.5, 0.0, 2, refinement=refinement)
        both.append(drawn(renderer, finer.mesh, camera, pose))
    np.testing.assert_allclose(both[0], both[1], atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_flat_and_far_reaching_triangles_cover_what_lies_between_their_edges(camera, looking_down, seed):
    """Needles hardly a row high, corners far outside: against the sign of each edge, in whole numbers."""
    rng = np.random.default_rng(seed)
    pose, region = looking_down(0.0, 300.0), Region(40, 30, 140, 110)
    # places on the grid of 1/256 sample that corners are kept on, in samples of the region
    wide = rng.integers(-30_000 * 256, 30_000 * 256, (60, 3, 2))
    flat = rng.integers([-90 * 256, 20 * 256], [190 * 256, 21 * 256 + 128], (60, 3, 2))
    y, x = (256 * axis for axis in np.mgrid[0 : region.size[1], 0 : region.size[0]])
    for corners in np.concatenate([wide, flat]).astype(np.int64):
        a, b, c = corners
        if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0:
            b, c = c, b
        inside = np.ones(x.shape, bool)
        rim = np.zeros(x.shape, bool)
        for start, end in ((a, b), (b, c), (c, a)):
            side = (end[0] - start[0]) * (y - start[1]) - (end[1] - start[1]) * (x - start[0])
            inside &= side < 0
            rim |= side == 0
        covered = drawn_corners((a, b, c), camera, pose, region)
        # single precision of the projection moves corners far outside by more than the grid
        tolerated = rim if np.abs(corners).max() < 256 * 512 else rim | _near_an_edge(corners, x, y, 0.2 * 256)
        assert np.array_equal(covered[~tolerated], inside[~tolerated])


@pytest.mark.parametrize("tilt_deg", [0.0, 50.0])
def test_a_texture_lies_on_the_body_in_perspective(camera, looking_down, tilt_deg):
    places = np.array([[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]])
    card, pose = flat_mesh(places, np.array([[0, 1, 2], [0, 2, 3]])), looking_down(tilt_deg, 250.0)
    squares = np.random.default_rng(6).integers(30, 255, (2, 4, 4, 3)).astype(np.uint8)
    textures = squares.repeat(16, axis=1).repeat(16, axis=2)
    uv = ((places + 40.0) / 80.0).astype(np.float32)
    mesh = replace(card, uv=uv, layer=np.ones(4, np.float32), textures=textures)
    image = drawn(matte_renderer(mesh, 0.5, 2), mesh, camera, pose)
    region = project(camera, pose, mesh.vertices_mm).region()
    for row, column in np.ndindex(4, 4):
        # the last row of a picture is where v is 0
        middle = [20.0 * column - 30.0, 30.0 - 20.0 * row, 0.0]
        x, y = np.rint(camera.project(pose, [middle])[0]).astype(int)
        expected = 0.5 * linear_from_encoded(squares[1, row, column] / 255.0)
        np.testing.assert_allclose(image[y - region.y0, x - region.x0], [*expected, 1.0], rtol=1e-4)


def test_small_triangles_cover_what_lies_between_their_edges(camera, looking_down):
    """Of all shapes up to a few samples, against the sign of each edge, in whole numbers; none before the first one."""
    rng = np.random.default_rng(4)
    pose, region = looking_down(0.0, 300.0), Region(40, 30, 90, 70)
    y, x = (256 * axis for axis in np.mgrid[0 : region.size[1], 0 : region.size[0]])
    # coarse places meet samples and each other, so that edges run through samples, level and upright ones too
    for step in (1, 64, 256):
        for corners in rng.integers(0, 10 * 256 // step, (80, 3, 2)) * step + 20 * 256:
            a, b, c = corners
            if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0:
                b, c = c, b
            sides = [(e - s, x - s[0], y - s[1]) for s, e in ((a, b), (b, c), (c, a))]
            signs = np.array([np.sign(along[0] * down - along[1] * right) for along, right, down in sides])
            covered = drawn_corners((a, b, c), camera, pose, region)
            assert np.all(covered[(signs < 0).all(axis=0)])
            assert not np.any(covered[(signs > 0).any(axis=0)])


def drawn_corners(corners, camera, pose, region):
    """Which samples a triangle covers whose corners lie on the grid of 1/256 sample of a region."""
    pixels = np.array(corners) / 256.0 + [region.x0, region.y0]
    k = camera.camera_matrix
    normalised = (pixels - k[:2, 2]) / [k[0, 0], k[1, 1]]
    points = (np.column_stack([normalised, np.ones(3)]) * 300.0 - pose.translation) @ pose.rotation
    mesh = Mesh(points, np.tile([0.0, 0, 1], (3, 1)), np.array([[0, 1, 2]], np.int32), np.ones((3, 3), np.float32))
    return drawn(matte_renderer(mesh, 1.0), mesh, camera, pose, region=region)[..., 3] > 0.0


def _near_an_edge(corners, x, y, distance):
    near = np.zeros(x.shape, bool)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start).astype(float)
        side = along[0] * (y - start[1]) - along[1] * (x - start[0])
        near |= np.abs(side) < distance * np.hypot(*along)
    return near
