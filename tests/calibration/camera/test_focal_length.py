"""A camera estimated from photographs of the sheet."""

import re

import numpy as np
import pytest

from arlight.calibration.camera.focal_length import estimate_camera
from arlight.errors import CalibrationError
from arlight.video.frame import Frame

STANDS = [(45, -100), (35, -70), (50, -120), (40, -60), (30, -140)]


@pytest.fixture(scope="module")
def clip(sheet_print, lens_camera, look, photograph):
    """A few frames of a walk around the sheet; its poses are kept beside."""
    frames = []
    for k, (tilt, azimuth) in enumerate(STANDS):
        pose = look(tilt, azimuth, 145.0 + 5 * k, 3.0 * k)
        image = photograph(sheet_print, lens_camera, pose, (0.7, 0.65, 0.6), seed=k)
        frames.append(Frame.from_rgb(image, k, k / 25))
    return frames


def test_the_focal_length_is_that_of_the_camera(clip, small_sheet, lens_camera):
    found = estimate_camera(clip, small_sheet)
    truth = lens_camera.camera_matrix
    error = np.log(found.camera.camera_matrix[1, 1] / truth[1, 1])
    assert abs(error) < 0.003
    assert abs(error) < 4.0 * found.focal_stddev
    assert found.camera.image_size == (640, 480)
    assert found.residual_px < 0.1
    assert found.frames == (0, 1, 2, 3, 4)
    assert re.search(r"focal length 5[56]\d px \+- [\d.]+ % .* 5 frames", found.summary)


def test_only_as_much_of_a_clip_is_read_as_is_needed(clip, small_sheet):
    read = []

    def endless():
        while True:
            read.append(len(read))
            yield clip[len(read) % len(clip)]

    estimate_camera(endless(), small_sheet)
    assert len(read) < 300


def test_a_still_camera_counts_as_one_view(clip, small_sheet):
    alone, repeated = estimate_camera(clip[:1], small_sheet), estimate_camera(clip[:1] * 10, small_sheet, 10)
    assert len(repeated.frames) == 1
    assert repeated.focal_stddev == pytest.approx(alone.focal_stddev, rel=1e-6)
    assert alone.focal_stddev > estimate_camera(clip, small_sheet).focal_stddev


def test_a_view_from_above_is_refused_with_what_to_do(small_sheet, sheet_print, lens_camera, look, photograph):
    frames = [
        Frame.from_rgb(photograph(sheet_print, lens_camera, look(1.0, 90.0 * k, 150.0 + 5 * k), seed=k), k, k / 25)
        for k in range(2)
    ]
    with pytest.raises(CalibrationError, match=r"straight above.*30 to 55 degrees.*--camera"):
        estimate_camera(frames, small_sheet)


@pytest.mark.parametrize(
    "frames", [[], [Frame.from_rgb(np.full((240, 320, 3), 80, np.uint8))] * 3], ids=["none", "wall"]
)
def test_a_clip_without_the_sheet_is_refused(small_sheet, frames):
    with pytest.raises(CalibrationError, match=r"four of the sheet's markers.*--camera"):
        estimate_camera(frames, small_sheet)
