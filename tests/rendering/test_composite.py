import numpy as np
import pytest

from arlight.rendering.composite import cover, shade_plane
from arlight.rendering.shadow import PlaneGrid
from arlight.video.frame import Region


def ramp_ratio(grid):
    """A ratio that is linear on the plane, so that bilinear lookup has no error."""
    p = grid.texel_centres_mm()
    return np.stack([0.5 + 0.004 * p[:, 0], 0.5 + 0.004 * p[:, 1], np.full(len(p), 0.7)], -1).reshape(grid.side, -1, 3)


@pytest.mark.parametrize("which", ["camera", "lens_camera"])
def test_every_pixel_takes_the_ratio_of_the_point_it_sees(request, which, pose):
    camera = request.getfixturevalue(which)
    grid = PlaneGrid((-50.0, -50.0), 2.0, 50)
    region = Region(100, 80, 230, 170)
    linear = np.full((90, 130, 3), 0.8, np.float32)
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
        (x < corners[:, 0].min()) | (x > corners[:, 0].max()) | (y < corners[:, 1].min()) | (y > corners[:, 1].max())
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


def test_cover_is_over_in_linear_light():
    linear = np.full((6, 8, 3), 0.4, np.float32)
    drawn = np.zeros((2, 3, 4), np.float32)
    drawn[0, 0] = [0.9, 0.1, 0.0, 1.0]
    drawn[1, 2] = [0.1, 0.0, 0.2, 0.25]
    cover(linear, 4, 3, drawn)
    assert np.allclose(linear[3, 4], [0.9, 0.1, 0.0])
    assert np.allclose(linear[4, 6], [0.4, 0.3, 0.5])
    linear[3, 4] = linear[4, 6] = 0.4
    assert np.all(linear == np.float32(0.4))
