"""Chroma from luma along a line in linear light, and what measuring makes of chroma that streams store coarsely."""

import cv2
import numpy as np
import pytest

from arlight.color import encoded_from_linear
from arlight.probe.layout import design_probe
from arlight.tracking.block_color import color_line
from arlight.tracking.block_layout import BlockLayout
from arlight.tracking.blocks import BlockMeter
from arlight.tracking.decoding import decoding
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat

BT709 = PixelFormat("bt709", False, 8)
YCC_FROM_RGB = BT709.ycc_from_rgb().astype(float)
PROBE = design_probe(order=3)
LAYOUT = BlockLayout.of_probe(PROBE)
COUNT = len(LAYOUT.half_mm)
PATTERNED = np.any(LAYOUT.cycles_per_mm != 0.0, axis=1)
LINES = {
    "amber": ([0.01, 0.012, 0.02], [0.9, 0.5, 0.15]),
    "grey": ([0.002, 0.002, 0.002], [0.3, 0.3, 0.3]),
    "blue": ([0.05, 0.02, 0.01], [0.07, 0.2, 0.6]),
}
TRANSFERS = ["srgb", "bt709", "gamma22", "hlg", "linear"]


@pytest.mark.parametrize("transfer", TRANSFERS)
@pytest.mark.parametrize("name", LINES)
def test_chroma_of_pixels_between_black_and_white_is_known_from_their_luma(transfer, name):
    dark, bright = (np.array(color) for color in LINES[name])
    luma, chroma = color_line(dark, bright, decoding(transfer), YCC_FROM_RGB)
    assert np.all(np.diff(luma) >= 0.0)
    # to white and somewhat beyond, but not to where the brightest channel clips
    reach = min(1.2, 0.9 * (1.0 - dark.max()) / (bright - dark).max())
    linear = dark + np.linspace(0.0, reach, 101)[:, None] * (bright - dark)
    ycc = encoded_from_linear(linear, transfer).astype(float) @ YCC_FROM_RGB.T
    found = np.column_stack([np.interp(ycc[:, 0], luma, chroma[:, c]) for c in range(2)])
    # a level of eight bits is 1/224; the line between nodes bends by less than half of one
    np.testing.assert_allclose(found, ycc[:, 1:], atol=0.5 / 224)


def test_a_colour_line_has_a_direction_and_no_length():
    dark, bright = (np.array(color) for color in LINES["amber"])
    one = color_line(dark, bright, decoding("srgb"), YCC_FROM_RGB)
    other = color_line(dark, dark + 0.2 * (bright - dark), decoding("srgb"), YCC_FROM_RGB)
    for first, second in zip(one, other, strict=True):
        np.testing.assert_allclose(first, second, atol=1e-6)


def test_black_that_is_as_bright_as_white_still_gives_a_line():
    same = np.full(3, 0.2)
    luma, chroma = color_line(same, same, decoding("srgb"), YCC_FROM_RGB)
    assert np.all(np.isfinite(luma))
    np.testing.assert_allclose(chroma, 0.0, atol=1e-6)


def film_points(camera, pose):
    """(pixels, 2) where each pixel's ray meets the film [mm]."""
    width, height = camera.image_size
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2).astype(float)
    rays = np.column_stack([camera.rays(grid), np.ones(len(grid))]) @ pose.rotation
    centre = pose.camera_centre_mm
    return (centre - rays * (centre[2] / rays[:, 2:]))[:, :2]


def striped(camera, pose, rows):
    """Encoded R'G'B' (h, w, 3), sRGB, of blocks whose light has the rows (blocks, 7, 3)."""
    film = film_points(camera, pose)
    light = np.full((len(film), 3), 0.2)
    for block in range(COUNT):
        here = np.abs(film - LAYOUT.centers_mm[block]).max(axis=1) < LAYOUT.half_mm[block]
        phase = 2 * np.pi * film[here] @ LAYOUT.cycles_per_mm[block]
        waves = [np.ones(len(phase)), *(wave(m * phase) for m in (1, 2, 3) for wave in (np.cos, np.sin))]
        light[here] = np.stack(waves, axis=1) @ rows[block]
    width, height = camera.image_size
    return encoded_from_linear(np.clip(light, 0.0, 1.0)).astype(float).reshape(height, width, 3)


def filmed(rgb, variance_px2=0.0, shift_px=(0.0, 0.0), tagged_px=(0.0, 0.0), bits=10) -> Frame:
    """A 4:2:0 frame: chroma is averaged over four pixels after a Gaussian filter; it lies `shift_px` from there."""
    format_ = PixelFormat("bt709", False, bits, (1, 1), (0.5 + tagged_px[0], 0.5 + tagged_px[1]))
    ycc = rgb @ format_.ycc_from_rgb().astype(float).T
    # what is seen at a place comes from beside it
    move = np.array([[1.0, 0.0, -shift_px[0]], [0.0, 1.0, -shift_px[1]]])
    size = rgb.shape[1::-1]
    planes = [ycc[..., 0]]
    for c in (1, 2):
        chroma = cv2.warpAffine(ycc[..., c], move, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        if variance_px2 > 0.0:
            chroma = cv2.GaussianBlur(chroma, (0, 0), np.sqrt(variance_px2), borderType=cv2.BORDER_REPLICATE)
        planes.append(chroma.reshape(size[1] // 2, 2, size[0] // 2, 2).mean(axis=(1, 3)))
    codes = []
    for plane, (zero, span) in zip(planes, [format_.luma_code_range, *[format_.chroma_code_range] * 2], strict=True):
        codes.append(np.rint(zero + span * plane).astype(format_.dtype))
    return Frame(0, 0.0, tuple(codes), format_)


def coloured_rows(generator, harmonics):
    """Rows (blocks, 7, 3) of stripes in the colours of some warm and some cold light, as many as are resolved."""
    rows = np.zeros((COUNT, 7, 3))
    tint = generator.uniform([0.7, 0.5, 0.2], [1.0, 0.6, 0.7], (COUNT, 3))
    rows[:, 0] = 0.35 * tint
    strength = np.repeat([0.15, 0.05, 0.03], 2) * generator.uniform(-0.7, 0.7, (COUNT, 6))
    rows[:, 1:] = strength[..., None] * tint[:, None]
    resolved = np.repeat(np.arange(1, 4), 2) <= harmonics[:, None]
    rows[:, 1:] *= (resolved & PATTERNED[:, None])[..., None]
    return rows


@pytest.fixture(scope="module")
def view(camera, look):
    """A meter, a pose, and how many harmonics and cycles a pixel the blocks have there."""
    pose = look(15.0, 30.0, 200.0)
    meter = BlockMeter(PROBE, camera, 10**6)
    means = meter.measure(filmed(np.full((480, 640, 3), 0.5)), pose, 0.3)
    assert means.valid.sum() > 40
    return meter, camera, pose, means.harmonics, np.hypot(*means.cycles_per_px.T)


STREAMS = [
    (0.0, (0.0, 0.0), (0.0, 0.0)),
    (1.0, (0.0, 0.0), (0.0, 0.0)),
    (0.5, (-0.25, 0.3), (0.0, 0.0)),
    (0.5, (0.7, -0.5), (0.7, -0.5)),
    (0.5, (0.4, 0.3), (0.5, 0.0)),
]
"""Variance of the filter [px^2], where chroma lies and where the tags say so [px]."""


@pytest.mark.parametrize(("variance_px2", "shift_px", "tagged_px"), STREAMS)
def test_chroma_that_is_as_predicted_is_left_alone_whatever_the_stream_did(view, variance_px2, shift_px, tagged_px):
    meter, camera, pose, harmonics, _ = view
    rows = coloured_rows(np.random.default_rng(1), harmonics)
    frame = filmed(striped(camera, pose, rows), variance_px2, shift_px, tagged_px)
    means = meter.measure(frame, pose, 0.3, rows)
    error = (means.values - rows)[means.valid]
    # what bleeds in from the neighbours' colours is not the stripes' own
    assert np.abs(error[:, 0]).max() < 0.012
    assert np.sqrt(np.mean(error[:, 0] ** 2)) < 0.002
    assert np.sqrt(np.mean(error[:, 1:] ** 2)) < 0.001


@pytest.mark.parametrize(("variance_px2", "shift_px", "tagged_px"), STREAMS)
def test_stripes_of_another_colour_than_predicted_are_seen(view, variance_px2, shift_px, tagged_px):
    meter, camera, pose, harmonics, frequency = view
    rows = coloured_rows(np.random.default_rng(2), harmonics)
    frame = filmed(striped(camera, pose, rows), variance_px2, shift_px, tagged_px)
    predicted = rows.copy()
    odd = np.arange(COUNT) % 5 == 0
    predicted[odd, 1:3] *= (1.15, 1.0, 0.8)
    means = meter.measure(frame, pose, 0.3, predicted)
    coarse = odd & PATTERNED & means.valid & (frequency < 0.12)
    assert coarse.sum() >= 3
    left, amiss = (means.values - rows)[coarse, 1:3], (predicted - rows)[coarse, 1:3]
    assert np.sqrt(np.mean(left**2)) < 0.35 * np.sqrt(np.mean(amiss**2))
    right = ~odd & means.valid
    assert np.sqrt(np.mean((means.values - rows)[right, 1:3] ** 2)) < 0.002


def test_means_of_another_colour_than_predicted_are_seen(view):
    meter, camera, pose, harmonics, _ = view
    rows = coloured_rows(np.random.default_rng(3), harmonics)
    predicted = rows * (1.15, 1.0, 0.8)
    means = meter.measure(filmed(striped(camera, pose, rows), 0.5), pose, 0.3, predicted)
    left, amiss = (means.values - rows)[means.valid, 0], (predicted - rows)[means.valid, 0]
    assert np.sqrt(np.mean(left**2)) < 0.08 * np.sqrt(np.mean(amiss**2))


def test_what_the_stream_dropped_is_predicted_and_not_trusted(camera, look):
    # from far, the finest stripes are gone from the chroma
    pose = look(15.0, 30.0, 480.0)
    meter = BlockMeter(PROBE, camera, 10**6)
    means = meter.measure(filmed(np.full((480, 640, 3), 0.5)), pose, 0.3)
    frequency = np.hypot(*means.cycles_per_px.T)
    rows = coloured_rows(np.random.default_rng(4), means.harmonics)
    means = meter.measure(filmed(striped(camera, pose, rows), 1.5), pose, 0.3, rows)
    assert np.all((means.color_trust >= 0.0) & (means.color_trust <= 1.0))
    fine = (frequency > 0.4) & means.valid
    assert fine.sum() > 5
    assert means.color_trust[fine].max() < 0.1
    near = meter.measure(filmed(striped(camera, look(15.0, 30.0, 150.0), rows)), look(15.0, 30.0, 150.0), 0.3, rows)
    swing = np.hypot(rows[:, 1], rows[:, 2])
    coarse = near.valid & (np.hypot(*near.cycles_per_px.T) < 0.1) & (np.ptp(swing, axis=1) > 0.04)
    assert coarse.sum() >= 3
    assert near.color_trust[coarse].min() > 0.8
    error = (means.values - rows)[fine, 1:3]
    assert np.sqrt(np.mean(error**2)) < 0.2 * np.sqrt(np.mean(rows[fine, 1:3] ** 2))


def test_no_colour_at_all_stays_none(view):
    meter, camera, pose, harmonics, _ = view
    rows = np.repeat(coloured_rows(np.random.default_rng(5), harmonics).mean(axis=2, keepdims=True), 3, axis=2)
    frame = filmed(striped(camera, pose, rows), 1.0)
    for stripes in (None, rows):
        means = meter.measure(frame, pose, 0.3, stripes)
        assert np.all(np.isfinite(means.values))
        np.testing.assert_allclose(means.values, means.values[..., 1:2].repeat(3, axis=2), atol=2e-3)


def test_a_picture_much_brighter_than_predicted_keeps_its_mean_colour(view):
    meter, camera, pose, harmonics, _ = view
    rows = coloured_rows(np.random.default_rng(6), harmonics)
    frame = filmed(striped(camera, pose, rows), 0.5)
    for factor in (0.25, 4.0):
        means = meter.measure(frame, pose, 0.3, factor * rows)
        error = (means.values - rows)[means.valid, 0]
        assert np.sqrt(np.mean(error**2)) < 0.02 * rows[:, 0].mean()
