import numpy as np
import pytest

from arlight.camera import Pose
from arlight.rendering.projection import project
from arlight.video.frame import Region


def points(count=50, seed=2):
    return np.random.default_rng(seed).uniform([-40, -40, 0], [40, 40, 50], (count, 3))


@pytest.mark.parametrize("which", ["camera", "lens_camera"])
def test_clip_coordinates_land_where_the_camera_sees_the_points(request, which, pose):
    camera = request.getfixturevalue(which)
    region = Region(37, 21, 250, 190)
    clip = project(camera, pose, points()).clip_coordinates(region)
    ndc = clip[:, :3] / clip[:, 3:]
    width, height = region.size
    # a viewport spans its pixels' edges; pixel centres lie at integers
    x = region.x0 + (ndc[:, 0] + 1.0) / 2.0 * width - 0.5
    y = region.y0 + (ndc[:, 1] + 1.0) / 2.0 * height - 0.5
    assert np.allclose(np.stack([x, y], -1), camera.project(pose, points()), atol=2e-3)
    assert np.all(np.abs(ndc[:, 2]) < 1.0)


def test_nearer_points_are_in_front(camera, pose):
    p = points()
    clip = project(camera, pose, p).clip_coordinates(Region(0, 0, 10, 10))
    distance = pose.transform(p)[:, 2]
    assert np.array_equal(np.argsort(clip[:, 2] / clip[:, 3]), np.argsort(distance))


def test_region_holds_the_points(lens_camera, pose):
    p = points()
    region = project(lens_camera, pose, p).region()
    pixels = lens_camera.project(pose, p)
    assert region.x0 <= pixels[:, 0].min() - 1
    assert region.x1 > pixels[:, 0].max() + 1
    assert region.clipped(lens_camera.image_size) == region


def test_region_of_what_is_not_seen(camera, pose):
    assert project(camera, pose, points() + [900.0, 0.0, 0.0]).region() is None
    behind = Pose(pose.rotation, -pose.translation)
    assert project(camera, behind, points()).region() is None


def test_region_is_the_frame_when_the_object_reaches_behind_the_camera(camera, pose):
    around = np.concatenate([points(), [pose.camera_centre_mm * 1.2]])
    assert project(camera, pose, around).region() == Region(0, 0, 320, 240)


def test_a_lens_does_not_fold_far_points_back_into_the_frame(lens_camera, pose):
    far = np.array([[4000.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    pixels = project(lens_camera, pose, far).pixels
    assert pixels[0, 0] > 320
    assert np.allclose(pixels[1], lens_camera.project(pose, far[1:])[0])
