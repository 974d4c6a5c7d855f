"""Blocks of ray-traced pictures, whose paper is lit by FFT transport: nothing here knows the stripes' closed form."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from arlight.camera import Pose
from arlight.color import encoded_from_linear
from arlight.environment import Environment
from arlight.errors import RenderingUnavailableError
from arlight.probe.layout import design_probe
from arlight.synthetic.light_script import LightScript, exposure_for
from arlight.synthetic.motion import CameraMotion
from arlight.synthetic.settings import default_camera
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.stage import Stage
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.blocks import BlockMeter
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat
from arlight.video.writer import encoded_format

PROBE = design_probe(order=2, pixels_per_mm=10.0)
CAMERA = default_camera((640, 480))
POSE = CameraMotion("still", 430.0).pose(0.0, CAMERA, PROBE.sheet_mm)
BLOCKS = field_blocks(PROBE)
KINDS = np.array([block.kind for block in BLOCKS])
COLORS = {"amber": (1.0, 0.5, 0.15), "blue": (0.15, 0.5, 1.0), "green": (0.2, 1.0, 0.3)}


def sky(color) -> Environment:
    """A dim sky and a lamp that the camera does not see mirrored, in one colour."""
    theta, phi = (np.arange(64) + 0.5)[:, None] * np.pi / 64, (np.arange(128) + 0.5) * np.pi / 64
    up = np.broadcast_to(np.cos(theta), (64, 128))
    directions = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), up], axis=-1)
    lamp = np.array([-0.5, -0.4, 0.77])
    light = 0.3 + 12.0 * np.exp((directions @ lamp / np.linalg.norm(lamp) - 1.0) / 0.02)
    return Environment((light[..., None] * np.array(color)).astype(np.float32))


@pytest.fixture(scope="module")
def layers():
    return SheetLayers.of_probe(PROBE)


@pytest.fixture(scope="module")
def picture(layers):
    """Linear radiance (h, w, 3) of the sheet in light of a colour; white paper in the open is `white`."""
    taken = {}

    def take(color=(1.0, 1.0, 1.0), white=0.6, pose: Pose = POSE):
        key = (color, white, pose.translation.tobytes())
        if key not in taken:
            script = LightScript(sky(color))
            script = script.scaled(exposure_for(script, PROBE.paper_reflectance, white))
            try:
                stage = Stage(layers, PROBE.slab, CAMERA, script)
            except RenderingUnavailableError as error:
                pytest.skip(f"no headless OpenGL through EGL: {error}")
            taken[key] = stage.picture(0.0, pose)
            stage.close()
        return taken[key]

    return take


@pytest.fixture(scope="module")
def meter():
    return BlockMeter(PROBE, CAMERA)


def photograph(linear) -> Frame:
    return Frame.from_rgb(np.rint(encoded_from_linear(linear) * 255).astype(np.uint8))


def middle_of(linear, block):
    """Radiance (n, 3) and film points (n, 2) over one period each way of the paper in a block's middle.

    That is whole periods of any stripes.
    """
    period, across = PROBE.slab.period_mm, 96
    steps = ((np.arange(across) + 0.5) / across - 0.5) * period
    paper = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) + block.center_mm
    film = paper
    for _ in range(20):
        film = paper + PROBE.slab.offset_mm(POSE.view_directions(np.column_stack([film, np.zeros(len(film))])))
    pixels = CAMERA.project(POSE, np.column_stack([film, np.zeros(len(film))])).astype(np.float32)
    x, y = pixels.reshape(across, across, 2).transpose(2, 0, 1)
    return cv2.remap(linear, x, y, cv2.INTER_LANCZOS4).reshape(-1, 3), film


def area_mean(linear, block):
    """Mean radiance (3,) of a block's middle."""
    return middle_of(linear, block)[0].mean(axis=0)


def white_of(linear):
    return np.mean([area_mean(linear, block) for block in BLOCKS if block.kind == "clear_white"], axis=0)


@pytest.mark.parametrize("color", [(1.0, 1.0, 1.0), COLORS["amber"]])
def test_means_are_area_averages_of_the_radiance(picture, meter, color):
    linear = picture(color)
    means = meter.measure(photograph(linear), POSE, 0.0)
    expected = np.array([area_mean(linear, block) for block in BLOCKS])
    assert np.all(means.valid)
    error = (means.values[:, 0] - expected) / white_of(linear)
    # white paper falls off toward its darker neighbours, and its mean is taken over more than a period
    assert np.abs(error[KINDS == "clear_white"]).max() < 0.01
    assert np.abs(error[KINDS != "clear_white"]).max() < 0.005
    assert np.sqrt(np.mean(error**2)) < 0.002


def test_harmonics_are_those_of_the_stripes(picture, meter):
    linear = picture()
    means = meter.measure(photograph(linear), POSE, 0.0)
    patterned = KINDS == "pattern"
    assert np.all(means.harmonics[patterned] >= 1)
    assert np.all(means.harmonics[~patterned] == 0)
    assert np.all(means.values[~patterned, 1:] == 0.0)
    # the stripes are all there is: what a pixel has beside them is rounding to eight bits, at most half a level of
    # encoded 0.8, whose slope is 1.8
    assert np.sqrt(means.pixel_variance.max()) < 1.8 / 255
    errors = []
    for i in np.flatnonzero(patterned):
        radiance, film = middle_of(linear, BLOCKS[i])
        phase = 2 * np.pi * film @ np.array(BLOCKS[i].frequency) / PROBE.slab.period_mm
        orders = np.arange(1, means.harmonics[i] + 1)
        waves = np.stack([wave(m * phase) for m in orders for wave in (np.cos, np.sin)])
        expected = 2 * waves @ radiance / len(phase)
        errors.append((means.values[i, 1 : 1 + len(waves)] - expected) / white_of(linear))
    # plain correlation over a period takes a share of the shading for stripes
    assert np.abs(np.concatenate(errors)).max() < 0.02
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 0.005


def test_means_scale_with_the_light(picture, meter):
    dim, bright = (meter.measure(photograph(picture(white=white)), POSE, 0.0) for white in (0.3, 0.6))
    level = bright.values[KINDS == "clear_white", 0].max()
    np.testing.assert_allclose(2.0 * dim.values, bright.values, atol=0.005 * level)
    np.testing.assert_array_equal(dim.samples, bright.samples)
    np.testing.assert_array_equal(dim.view_phasor, bright.view_phasor)


def test_the_view_is_the_direction_from_each_block_to_the_camera(picture, meter):
    means = meter.measure(photograph(picture()), POSE, 0.0)
    for i, block in enumerate(BLOCKS):
        film = np.append(block.center_mm, 0.0)
        film[:2] += PROBE.slab.offset_mm(POSE.view_directions(film))
        # toward where the paper's middle is seen through the film
        view = POSE.view_directions(film)
        assert means.view_cosine[i] == pytest.approx(view[2], abs=1e-3)
        b = 2 * np.pi * np.dot(block.frequency or (0, 0), PROBE.slab.light_plane(view))
        assert abs(np.angle(means.view_phasor[i] * np.exp(1j * b))) < 0.01
        assert 0.98 < abs(means.view_phasor[i]) <= 1.0 + 1e-12


def test_overexposed_blocks_are_not_valid_and_dark_ones_are(picture, meter):
    means = meter.measure(photograph(picture(white=3.0)), POSE, 0.0)
    assert not np.any(means.valid[KINDS == "clear_white"])
    assert np.all(means.valid[np.isin(KINDS, ["clear_black", "black_white", "black_black"])])


def test_a_block_that_is_partly_clipped_is_judged_by_the_rest_or_not_at_all(picture, meter):
    linear = picture().copy()
    pixels = CAMERA.project(POSE, np.array([[*block.center_mm, 0.0] for block in BLOCKS]))
    for x, y in np.rint(pixels).astype(int):
        cv2.circle(linear, (int(x), int(y)), 2, (5.0, 5.0, 5.0), -1)
    spotted = meter.measure(photograph(linear), POSE, 0.0)
    clean = meter.measure(photograph(picture()), POSE, 0.0)
    assert np.all(spotted.samples < clean.samples)
    kept = spotted.valid
    assert kept.sum() > 0.8 * len(BLOCKS)
    level = clean.values[KINDS == "clear_white", 0].mean()
    np.testing.assert_allclose(spotted.values[kept, 0], clean.values[kept, 0], atol=0.01 * level)


def test_blocks_out_of_the_picture_are_not_seen(picture, meter):
    aside = Pose(POSE.rotation, POSE.translation + np.array([0.5 * POSE.translation[2], 0.0, 0.0]))
    means = meter.measure(photograph(picture(pose=aside)), aside, 0.0)
    pixels = CAMERA.project(aside, np.array([[*block.center_mm, 0.0] for block in BLOCKS]))
    out, inside = pixels[:, 0] > CAMERA.image_size[0] + 40, pixels[:, 0] < CAMERA.image_size[0] - 50
    assert out.sum() > 3
    assert inside.sum() > 3
    assert np.all(means.samples[out] == 0)
    assert not np.any(means.valid[out])
    assert np.all(means.valid[inside])
    assert all(np.all(np.isfinite(getattr(means, name))) for name in ("values", "covariance", "view_phasor"))
    away = Pose(POSE.rotation, POSE.translation + np.array([0.0, 3.0 * POSE.translation[2], 0.0]))
    nothing = meter.measure(photograph(picture()), away, 0.0)
    assert not np.any(nothing.valid)
    assert np.all(nothing.samples == 0)


def difference(one, other, level):
    """Largest difference of the means and rms difference of the stripes over the brightest channel's white."""
    change = (one.values - other.values) / np.max(level)
    return np.abs(change[:, 0]).max(), np.sqrt(np.mean(change[:, 1:] ** 2))


@pytest.mark.parametrize("color", COLORS)
@pytest.mark.parametrize("blur_px", [0.0, 0.8])
def test_half_resolution_chroma_measures_what_full_resolution_does(picture, meter, color, blur_px):
    linear = picture(COLORS[color])
    if blur_px:
        linear = cv2.GaussianBlur(linear, (0, 0), blur_px)
    frame = photograph(linear)
    full = meter.measure(frame, POSE, blur_px)
    small = encoded_format(frame)
    assert small.chroma_shift == (1, 1)
    white = white_of(linear)
    coarse = meter.measure(frame.converted(small), POSE, blur_px)
    mean, stripes = difference(coarse, full, white)
    # half a code of chroma is 0.002 encoded, times 1.9 for blue and 1.8 for the curve
    assert mean < 0.016
    assert stripes < 0.003
    fine = meter.measure(frame.converted(replace(small, bit_depth=10)), POSE, blur_px)
    mean, stripes = difference(fine, full, white)
    assert mean < 0.006
    assert stripes < 0.002
    assert np.all((coarse.color_trust >= 0.0) & (coarse.color_trust <= 1.0))
    assert np.all(full.color_trust == 1.0)


@pytest.mark.parametrize("offset", [(0.0, 0.5), (0.5, 0.5), (0.0, 0.0)])
def test_the_chroma_site_does_not_matter(picture, meter, offset):
    linear = picture(COLORS["amber"])
    frame = photograph(linear)
    format_ = replace(encoded_format(frame), bit_depth=10, chroma_offset_px=offset)
    mean, stripes = difference(
        meter.measure(frame.converted(format_), POSE, 0.0), meter.measure(frame, POSE, 0.0), white_of(linear)
    )
    assert mean < 0.006
    assert stripes < 0.002


def test_full_resolution_chroma_of_ten_bits_is_as_good_as_rgb(picture, meter):
    linear = picture(COLORS["amber"])
    frame = photograph(linear)
    format_ = PixelFormat("bt2020", True, 10)
    mean, stripes = difference(
        meter.measure(frame.converted(format_), POSE, 0.0), meter.measure(frame, POSE, 0.0), white_of(linear)
    )
    assert mean < 0.003
    assert stripes < 0.0005


def test_grey_frames_measure_the_same_in_every_channel(picture, meter):
    frame = photograph(picture())
    grey = Frame(0, 0.0, (frame.planes[1],), PixelFormat("gray", True, 8))
    means = meter.measure(grey, POSE, 0.0)
    np.testing.assert_allclose(means.values, meter.measure(frame, POSE, 0.0).values, atol=1e-9)
    np.testing.assert_array_equal(means.values[..., 0], means.values[..., 2])


def test_measuring_leaves_no_trace_in_the_next_frame(picture):
    used, new = BlockMeter(PROBE, CAMERA), BlockMeter(PROBE, CAMERA)
    frame = photograph(picture())
    other = photograph(picture(COLORS["amber"], white=3.0))
    used.measure(other.converted(encoded_format(other)), POSE, 1.5)
    first, again = used.measure(frame, POSE, 0.4), new.measure(frame, POSE, 0.4)
    for name in ("values", "covariance", "pixel_variance", "samples", "valid", "view_phasor"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))


def test_fewer_samples_cost_little_and_lend_wider_error_bars(picture, meter):
    frame = photograph(picture())
    full, sparse = meter.measure(frame, POSE, 0.0), BlockMeter(PROBE, CAMERA, 400).measure(frame, POSE, 0.0)
    fewer = sparse.samples < 0.5 * full.samples
    assert fewer.sum() > 0.4 * len(BLOCKS)
    assert np.all(sparse.valid)
    assert np.all(sparse.covariance[fewer, 0, 0] > 2.0 * full.covariance[fewer, 0, 0])
    level = full.values[KINDS == "clear_white", 0].mean()
    np.testing.assert_allclose(sparse.values, full.values, atol=0.003 * level)


def test_a_frame_may_be_sampled_with_less_than_there_is_room_for(picture, meter):
    frame = photograph(picture())
    full, few, more = (meter.measure(frame, POSE, 0.0, samples=count) for count in (None, 400, 10**9))
    made = BlockMeter(PROBE, CAMERA, 400).measure(frame, POSE, 0.0)
    assert few.samples.max() <= 400 < full.samples.max()
    np.testing.assert_array_equal(few.samples, made.samples)
    np.testing.assert_array_equal(more.values, full.values)


def test_an_unknown_blur_is_no_obstacle(picture, meter):
    means = meter.measure(photograph(picture()), POSE, float("nan"))
    assert np.all(means.valid)
    assert np.all(np.isfinite(means.values))
