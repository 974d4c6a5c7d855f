"""The white paper's level in photographs under known light."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.camera.exposure import ExposureMeter
from arlight.calibration.camera.paper_samples import PaperSampler, read_encoded
from arlight.camera import Camera
from arlight.color import linear_from_encoded
from arlight.radiometry import Radiometry
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat

LIGHT = np.array([0.75, 0.6, 0.45])


def falling(x, y):
    """Light that is a sixth brighter at one side of the sheet, and bent."""
    return (1 + 0.002 * x - 0.0008 * y + 1e-5 * x * x)[..., None] * LIGHT


@pytest.fixture(scope="module")
def frames(sheet_print, lens_camera, look, photograph):
    poses = [look(30.0, -100.0, 145.0), look(50.0, -60.0, 160.0, 10.0)]
    return [
        (pose, Frame.from_rgb(photograph(sheet_print, lens_camera, pose, falling, seed=k)))
        for k, pose in enumerate(poses)
    ]


def expected(sampler, small_sheet):
    return falling(*sampler.paper_mm.T).mean(axis=0) * small_sheet.paper_reflectance


def test_the_level_is_that_of_the_paper_from_every_view(frames, small_sheet, lens_camera):
    meter = ExposureMeter(small_sheet, lens_camera)
    truth = expected(meter._sampler, small_sheet)
    for pose, frame in frames:
        found = meter.measure(frame, pose)
        assert found.valid
        np.testing.assert_allclose(found.level, truth, rtol=0.003)
        assert np.all(np.abs(found.level - truth) < 3.0 * np.sqrt(found.variance))
        assert found.share > 0.15


def test_a_common_gain_is_followed_to_a_fraction_of_a_per_cent(
    frames, small_sheet, sheet_print, lens_camera, photograph
):
    meter = ExposureMeter(small_sheet, lens_camera)
    pose, first = frames[0]
    gain = np.array([0.8, 0.9, 1.07])
    second = Frame.from_rgb(photograph(sheet_print, lens_camera, pose, lambda x, y: falling(x, y) * gain, seed=9))
    ratio = meter.measure(second, pose).level / meter.measure(first, pose).level
    np.testing.assert_allclose(ratio, gain, rtol=0.003)


def test_a_hand_over_a_part_of_the_frame_has_no_say(frames, small_sheet, lens_camera):
    meter = ExposureMeter(small_sheet, lens_camera)
    pose, frame = frames[0]
    image = np.stack(frame.planes, axis=-1).copy()
    x, y = lens_camera.project(pose, [[small_sheet.sheet_mm[0] / 2 - 6, small_sheet.sheet_mm[1] / 4, 0.0]])[0]
    image[int(y) - 40 : int(y) + 40, int(x) - 45 : int(x) + 45] = (150, 110, 90)
    covered = meter.measure(Frame.from_rgb(image), pose)
    clean = meter.measure(frame, pose)
    np.testing.assert_allclose(covered.level, clean.level, rtol=0.006)
    assert covered.share < clean.share


def test_clipped_paper_leaves_the_wedge(frames, small_sheet, sheet_print, lens_camera, photograph):
    meter = ExposureMeter(small_sheet, lens_camera)
    pose, _ = frames[0]
    bright = Frame.from_rgb(photograph(sheet_print, lens_camera, pose, lambda x, y: falling(x, y) * 2.2, seed=4))
    found = meter.measure(bright, pose)
    truth = 2.2 * expected(meter._sampler, small_sheet)
    assert truth[0] > 1.3
    np.testing.assert_allclose(found.level, truth, rtol=0.02)


def test_vignetting_and_response_are_taken_out(frames, small_sheet, sheet_print, lens_camera, photograph):
    pose, _ = frames[0]
    vignetting = (-0.35, 0.1, 0.0)
    dimmed = replace(lens_camera, vignetting=vignetting)
    x, y = np.meshgrid(np.arange(640.0), np.arange(480.0))
    gain = dimmed.gain(np.stack([x, y], axis=-1)).reshape(480, 640, 1)
    curve = lambda light: np.sqrt(light * gain)  # noqa: E731
    frame = Frame.from_rgb(photograph(sheet_print, lens_camera, pose, falling, curve, seed=5))
    squares = Radiometry(tuple(np.linspace(0, 1, 33) ** 2))
    meter = ExposureMeter(small_sheet, replace(dimmed, radiometry=squares))
    truth = expected(meter._sampler, small_sheet)
    np.testing.assert_allclose(meter.measure(frame, pose).level, truth, rtol=0.004)
    plain = ExposureMeter(small_sheet, lens_camera).measure(frame, pose)
    assert np.all(np.abs(plain.level / truth - 1) > 0.03)


def test_paper_out_of_the_picture_is_no_level(frames, small_sheet, lens_camera, look):
    meter = ExposureMeter(small_sheet, lens_camera)
    for pose in (look(30, 0, 150, off_mm=(900.0, 0.0)), look(30, 0, 4000.0)):
        found = meter.measure(frames[0][1], pose)
        assert not found.valid
        assert np.all(np.isinf(found.variance))
        assert found.share == 0.0


def test_samples_lie_on_what_they_are_said_to_lie_on(frames, small_sheet, lens_camera):
    pose, frame = frames[1]
    samples = PaperSampler(small_sheet, lens_camera).sample(frame, pose)
    light = linear_from_encoded(samples.encoded)
    white = falling(*samples.points_mm.T) * small_sheet.paper_reflectance
    # darkest step: a code is 4 % of it
    np.testing.assert_allclose(light / white, samples.reflectance[:, None] * np.ones(3), atol=0.05)
    assert len(np.unique(samples.patch)) >= 8


@pytest.mark.parametrize("shift", [(0, 0), (1, 0), (1, 1)])
def test_single_pixels_are_read_as_the_whole_picture_is(shift):
    rng = np.random.default_rng(1)
    format_ = PixelFormat("bt709", False, 8, shift)
    planes = [rng.integers(40, 200, (12, 16)).astype(np.uint8)]
    planes += [np.full(format_.chroma_size((16, 12))[::-1], code, np.uint8) for code in (110, 150)]
    frame = Frame(0, 0.0, tuple(planes), format_)
    x, y = np.meshgrid(np.arange(16), np.arange(12))
    found = read_encoded(frame, np.stack([x.ravel(), y.ravel()], axis=1))
    np.testing.assert_allclose(found.reshape(12, 16, 3), frame.encoded_rgb(chroma="bilinear"), atol=1e-5)


def test_grey_footage_is_read_too():
    frame = Frame(0, 0.0, (np.arange(48, dtype=np.uint8).reshape(6, 8) * 4,), PixelFormat("gray", True, 8))
    np.testing.assert_allclose(read_encoded(frame, np.array([[3, 2]])), np.full((1, 3), 19 * 4 / 255))


def test_a_camera_of_another_kind_measures_the_same_sheet(small_sheet):
    wide = Camera((64, 48), np.array([[30.0, 0, 32], [0, 30.0, 24], [0, 0, 1]]), np.zeros(5))
    assert len(PaperSampler(small_sheet, wide).paper_mm) > 200
