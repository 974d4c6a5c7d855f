"""The white paper's level in photographs under known light."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.camera.exposure import ExposureMeter, PaperLevel
from arlight.calibration.camera.paper_samples import PaperSampler, read_encoded
from arlight.camera import Camera
from arlight.color import encoded_from_linear, linear_from_encoded
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


def quadratic(x, y):
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def robust_level(samples, light, mean, half_mm):
    """Level of one channel and its variance, without a code's width: Tukey's biweight with medians, written out."""
    paper = (samples.patch < 0) & (light < 0.94)
    terms, values, sectors = quadratic(*(samples.points_mm[paper] / half_mm).T), light[paper], samples.sector[paper]
    weights = np.ones(len(values))
    for _ in range(8):
        normal = terms.T @ (weights[:, None] * terms)
        surface = np.linalg.solve(normal, terms.T @ (weights * values))
        residual = values - terms @ surface
        bound = 4.7 * max(1.4826 * np.median(np.abs(residual)), 0.002 * np.median(values))
        weights = np.maximum(1.0 - (residual / bound) ** 2, 0.0) ** 2
    score = (terms @ np.linalg.solve(normal, mean)) * weights * residual
    parts = np.array([score[sectors == k].sum() for k in np.unique(sectors)])
    return mean @ surface, np.sum(parts**2) * len(parts) / (len(parts) - 6)


def test_the_surface_is_that_of_iterated_least_squares(frames, small_sheet, lens_camera):
    meter, sampler = ExposureMeter(small_sheet, lens_camera), PaperSampler(small_sheet, lens_camera, 2.2, 256)
    half_mm = np.array(small_sheet.sheet_mm) / 2.0
    mean = quadratic(*(sampler.paper_mm / half_mm).T).mean(axis=0)
    code = 1.0 / 255.0
    for pose, frame in frames:
        samples, found = sampler.sample(frame, pose), meter.measure(frame, pose)
        for c in range(3):
            level, variance = robust_level(samples, linear_from_encoded(samples.encoded[:, c]), mean, half_mm)
            assert found.level[c] == pytest.approx(level, rel=3e-4)
            one_up, one_down = linear_from_encoded(encoded_from_linear(level) + np.array([0.5, -0.5]) * code)
            assert found.variance[c] == pytest.approx(variance + (one_up - one_down) ** 2 / 12.0, rel=0.1)


def test_a_frame_smaller_than_the_cameras_is_not_read_beyond_its_edges(frames, small_sheet, lens_camera):
    sampler, (pose, frame) = PaperSampler(small_sheet, lens_camera), frames[0]
    whole = sampler.sample(frame, pose)
    x0, y0 = np.median(whole.pixels, axis=0).astype(int)
    part = Frame.from_rgb(np.ascontiguousarray(np.stack(frame.planes, axis=-1)[:y0, :x0]))
    seen = sampler.sample(part, pose)
    inside = np.all(whole.pixels < (x0 - 1, y0 - 1), axis=1)
    assert 0 < np.count_nonzero(inside) < len(inside)
    np.testing.assert_array_equal(seen.pixels, whole.pixels[inside])
    np.testing.assert_array_equal(seen.encoded, whole.encoded[inside])


def test_a_sheet_behind_the_camera_or_nowhere_has_no_samples(frames, small_sheet, lens_camera):
    sampler, (pose, frame) = PaperSampler(small_sheet, lens_camera), frames[0]
    for other in (
        replace(pose, translation=-pose.translation),
        replace(pose, translation=np.full(3, np.nan)),
        replace(pose, translation=np.zeros(3)),
        replace(pose, rotation=np.full((3, 3), np.nan)),
    ):
        assert len(sampler.sample(frame, other).pixels) == 0


def test_samples_keep_clear_of_all_print(frames, small_sheet, lens_camera):
    sampler, (pose, frame) = PaperSampler(small_sheet, lens_camera), frames[1]
    samples = sampler.sample(frame, pose)
    corners = [marker.corners_mm for marker in small_sheet.markers]
    for square in corners:
        # along the square's edges, closely
        edge = np.concatenate([np.linspace(a, b, 30) for a, b in zip(square, np.roll(square, -1, axis=0), strict=True)])
        ink = lens_camera.project(pose, np.column_stack([edge, np.zeros(len(edge))]))
        distance = np.linalg.norm(samples.pixels[:, None] - ink, axis=-1)
        # rounding to a pixel may come half a diagonal closer
        assert distance.min() > 3.0 - 0.75


def test_a_few_points_are_a_fair_part_of_all(frames, small_sheet, lens_camera):
    pose, frame = frames[0]
    everything, few = (PaperSampler(small_sheet, lens_camera, 1.0, most).sample(frame, pose) for most in (None, 150))
    assert len(few.pixels) == 150 < len(everything.pixels)
    places = {tuple(place) for place in np.round(everything.points_mm, 9).tolist()}
    assert all(tuple(place) in places for place in np.round(few.points_mm, 9).tolist())
    assert len(np.unique(few.sector)) == len(np.unique(everything.sector))
    counts = [np.bincount(samples.sector, minlength=24) / len(samples.sector) for samples in (everything, few)]
    assert np.abs(counts[1] - counts[0]).max() < 0.06


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
    # rows of a decoder's planes are longer than the picture is wide, and may be strided
    planes = [np.repeat(np.pad(plane, ((0, 0), (0, 5))), 1 + k, axis=1)[:, : (1 + k) * plane.shape[1] : 1 + k]
              for k, plane in enumerate(planes)]  # fmt: skip
    frame = Frame(0, 0.0, tuple(planes), format_)
    x, y = np.meshgrid(np.arange(16), np.arange(12))
    found = read_encoded(frame, np.stack([x.ravel(), y.ravel()], axis=1))
    np.testing.assert_allclose(found.reshape(12, 16, 3), frame.encoded_rgb(chroma="bilinear"), atol=1e-5)


def test_deep_codes_are_read_too():
    rng = np.random.default_rng(2)
    format_ = PixelFormat("bt2020", False, 10)
    planes = tuple(rng.integers(200, 800, (6, 8)).astype(np.uint16) for _ in range(3))
    frame = Frame(0, 0.0, planes, format_)
    x, y = np.meshgrid(np.arange(8), np.arange(6))
    found = read_encoded(frame, np.stack([x.ravel(), y.ravel()], axis=1))
    np.testing.assert_allclose(found.reshape(6, 8, 3), frame.encoded_rgb(), atol=1e-6)


def test_grey_footage_is_read_too():
    frame = Frame(0, 0.0, (np.arange(48, dtype=np.uint8).reshape(6, 8) * 4,), PixelFormat("gray", True, 8))
    np.testing.assert_allclose(read_encoded(frame, np.array([[3, 2]])), np.full((1, 3), 19 * 4 / 255), rtol=1e-6)


def test_a_camera_of_another_kind_measures_the_same_sheet(small_sheet):
    wide = Camera((64, 48), np.array([[30.0, 0, 32], [0, 30.0, 24], [0, 0, 1]]), np.zeros(5))
    assert len(PaperSampler(small_sheet, wide).paper_mm) > 200


def test_a_level_is_known_within_a_share_of_itself():
    level = np.array([0.5, 0.2, 0.1])
    paper = PaperLevel(level, (0.01 * level) ** 2, 1.0)
    assert paper.is_known_within(0.011)
    assert not paper.is_known_within(0.009)
    for unknown in (PaperLevel(level, np.array([0.0, np.inf, 0.0]), 1.0), PaperLevel(level * np.nan, 0.0 * level, 0.0)):
        assert not unknown.is_known_within(1.0)
