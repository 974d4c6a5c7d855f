import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from arlight.camera import Camera, Pose
from arlight.rendering.composite import PlaneShader
from arlight.rendering.shadow import PlaneGrid
from arlight.video.frame import Region

NODE_PX = 4
"""Pixels between two at which the ratio is looked up; real maps are 1 where they end."""


def shade_plane(linear, region, camera, pose, grid, ratio):
    """Multiply light (h, w, 3) of a region by what is left of it, interpolated between nodes by another library."""
    padded = np.concatenate([ratio, np.zeros((*ratio.shape[:2], 1))], axis=2).astype(np.float32)
    left = PlaneShader(camera, grid).left(region, pose, padded)
    y, x = (np.arange(size) / NODE_PX for size in linear.shape[:2])
    nodes = tuple(np.arange(count) for count in left.shape[1:])
    points = np.stack(np.meshgrid(y, x, indexing="ij"), axis=-1)
    linear *= RegularGridInterpolator(nodes, np.moveaxis(left, 0, 2))(points).astype(np.float32)


def ramp_ratio(grid):
    """A ratio that is linear on the plane, so that bilinear lookup has no error."""
    p = grid.texel_centres_mm()
    return np.stack([0.5 + 0.004 * p[:, 0], 0.5 + 0.004 * p[:, 1], np.full(len(p), 0.7)], -1).reshape(grid.side, -1, 3)


@pytest.mark.parametrize("which", ["camera", "lens_camera"])
def test_every_pixel_takes_the_ratio_of_the_point_it_sees(request, which, pose):
    camera = request.getfixturevalue(which)
    grid = PlaneGrid((-50.0, -50.0), 2.0, 50)
    region = Region(100, 80, 232, 172)
    linear = np.full((92, 132, 3), 0.8, np.float32)
    shade_plane(linear, region, camera, pose, grid, ramp_ratio(grid).astype(np.float32))
    for place in ([0.0, 0.0], [20.0, -17.0], [-31.0, 12.0]):
        x, y = np.rint(camera.project(pose, [[*place, 0.0]])[0]).astype(int)
        # the point of the plane that this very pixel sees
        ray = pose.rotation.T @ [*camera.rays([[x, y]])[0], 1.0]
        centre = pose.camera_centre_mm
        seen = centre - ray * centre[2] / ray[2]
        expected = 0.8 * np.array([0.5 + 0.004 * seen[0], 0.5 + 0.004 * seen[1], 0.7])
        assert np.allclose(linear[y - 80, x - 100], expected, atol=1e-4)


def test_nothing_changes_outside_of_the_map_or_where_nothing_is_hidden(camera, pose):
    rng = np.random.default_rng(1)
    before = rng.random((240, 320, 3)).astype(np.float32)
    grid = PlaneGrid((-10.0, -10.0), 1.0, 20)
    after = before.copy()
    shade_plane(after, Region(0, 0, 320, 240), camera, pose, grid, np.zeros((20, 20, 3), np.float32))
    x, y = np.meshgrid(np.arange(320), np.arange(240))
    corners = camera.project(pose, [[sx * 10.0, sy * 10.0, 0.0] for sx in (-1, 1) for sy in (-1, 1)])
    outside = (
        (x < corners[:, 0].min() - NODE_PX)
        | (x > corners[:, 0].max() + NODE_PX)
        | (y < corners[:, 1].min() - NODE_PX)
        | (y > corners[:, 1].max() + NODE_PX)
    )
    assert np.array_equal(after[outside], before[outside])
    assert np.count_nonzero(after == 0.0) > 100
    same = before.copy()
    shade_plane(same, Region(0, 0, 320, 240), camera, pose, grid, np.ones((20, 20, 3), np.float32))
    assert np.allclose(same, before, rtol=1e-6)


def test_above_the_horizon_there_is_no_plane(camera, looking_down):
    grid = PlaneGrid((-500.0, -500.0), 10.0, 100)
    linear = np.ones((240, 320, 3), np.float32)
    nothing = np.zeros((100, 100, 3), np.float32)
    shade_plane(linear, Region(0, 0, 320, 240), camera, looking_down(85.0, 300.0), grid, nothing)
    assert np.all(linear[0] == 1.0)
    assert np.any(linear == 0.0)


def test_every_pixel_of_a_bent_picture_sees_the_plane_where_the_lens_says(camera, looking_down):
    """Against the exact ray of every pixel, at a strong barrel, to the picture's corners."""
    strong = Camera(camera.image_size, camera.camera_matrix, np.array([-0.3, 0.1, 0.004, -0.005, -0.01]))
    grid, pose = PlaneGrid((-400.0, -400.0), 8.0, 100), looking_down(20.0, 300.0)
    linear = np.ones((240, 320, 3), np.float32)
    p = grid.texel_centres_mm()
    ramp = np.stack([0.5 + 0.001 * p[:, 0], 0.5 + 0.001 * p[:, 1], np.ones(len(p))], -1).reshape(100, 100, 3)
    shade_plane(linear, Region(0, 0, 320, 240), strong, pose, grid, ramp)
    x, y = np.meshgrid(np.arange(320), np.arange(240))
    rays = np.concatenate([strong.rays(np.stack([x, y], -1).reshape(-1, 2)), np.ones((320 * 240, 1))], axis=1)
    toward = rays @ pose.rotation
    seen = pose.camera_centre_mm - toward * (pose.camera_centre_mm[2] / toward[:, 2])[:, None]
    inside = np.all((grid.texel_of(seen) >= 0.0) & (grid.texel_of(seen) < 99.0), axis=1)
    expected = np.where(inside[:, None], 0.5 + 0.001 * seen[:, :2], 1.0).reshape(240, 320, 2)
    assert inside.mean() > 0.9
    assert np.quantile(np.abs(linear[..., :2] - expected), 0.999) < 1e-4


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
def test_impossible_poses_and_edges_of_the_map_touch_no_foreign_memory(camera, pose, bad):
    grid = PlaneGrid((-10.0, -10.0), 1.0, 20)
    linear = np.ones((52, 60, 3), np.float32)
    for broken in (
        Pose(pose.rotation, np.array([0.0, bad, 300.0])),
        Pose(np.full((3, 3), bad), pose.translation),
        Pose(np.zeros((3, 3)), np.zeros(3)),
    ):
        shade_plane(linear, Region(8, 8, 68, 60), camera, broken, grid, np.ones((20, 20, 3)))
    assert np.all(linear == 1.0)
