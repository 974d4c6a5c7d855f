"""Markers' centres in ray-cast photographs, where ArUco's corners are drawn inward by blur."""

import numpy as np
import pytest

from arlight.calibration.camera.marker_points import MarkerPoints
from arlight.camera import Camera, Pose
from arlight.tracking.luma import luma_codes
from arlight.video.frame import Frame


@pytest.fixture(scope="module")
def points(small_sheet):
    return MarkerPoints(small_sheet)


def rms(errors):
    return np.sqrt(np.mean(np.sum(errors**2, axis=1)))


@pytest.mark.parametrize(("tilt", "blur_px"), [(20.0, 0.5), (50.0, 1.2)])
def test_aligned_centres_lie_where_the_markers_are(
    points, small_sheet, sheet_print, lens_camera, look, photograph, project, tilt, blur_px
):
    pose = look(tilt, -100.0, 150.0, 5.0)
    frame = Frame.from_rgb(photograph(sheet_print, lens_camera, pose, blur_px=blur_px))
    coarse = points.detect(frame.luma(), "picture")
    assert coarse.name == "picture"
    assert rms(coarse.pixels - project(lens_camera, pose, coarse.points_mm)) < 0.5
    # a camera that is off by 3 % and knows no distortion, and a pose off by two pixels
    rough = Camera(lens_camera.image_size, lens_camera.camera_matrix * [[1.03, 1, 1], [1, 1.03, 1], [1, 1, 1]], [])
    beside = Pose(pose.rotation, pose.translation * [1, 1, 1.03] + [0.5, 0.0, 0.0])
    fine = points.align(*luma_codes(frame), rough, beside, "picture")
    assert len(fine.pixels) == len(small_sheet.markers)
    # the texture's own texels are a sixth of a pixel
    assert rms(fine.pixels - project(lens_camera, pose, fine.points_mm)) < 0.05


def test_a_covered_marker_is_left_out(points, small_sheet, sheet_print, lens_camera, look, photograph):
    pose = look(30.0, -90.0, 150.0)
    image = photograph(sheet_print, lens_camera, pose)
    middle = np.array(small_sheet.markers[2].corners_mm).mean(axis=0)
    x, y = lens_camera.project(pose, [[*middle, 0.0]])[0].astype(int)
    image[y - 12 : y + 12, x - 40 : x + 40] = 90
    fine = points.align(*luma_codes(Frame.from_rgb(image)), lens_camera, pose, "hand")
    assert len(fine.points_mm) == len(small_sheet.markers) - 1
    assert np.min(np.linalg.norm(fine.points_mm - middle, axis=1)) > 5.0


def test_a_picture_without_the_sheet_shows_nothing(points, lens_camera, look):
    empty = np.full((480, 640), 120, np.uint8)
    assert points.detect(empty, "table") is None
    table = np.linspace(0, 1, 256, dtype=np.float32)
    assert points.align(empty, table, lens_camera, look(30, 0, 150), "table") is None
    assert points.align(empty, table, lens_camera, look(30, 0, 150, off_mm=(4000.0, 0.0)), "far") is None
