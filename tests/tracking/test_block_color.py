"""Chroma from luma along a line in linear light, and the corrections that the stored chroma asks for."""

import numpy as np
import pytest

from arlight.color import encoded_from_linear
from arlight.tracking.block_color import chroma_correction, color_line
from arlight.tracking.decoding import decoding
from arlight.video.pixel_format import PixelFormat

BT709 = PixelFormat("bt709", False, 8)
YCC_FROM_RGB = BT709.ycc_from_rgb().astype(float)
NOWHERE = np.zeros(2)
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


def swings(generator, count, size):
    return size * (generator.normal(size=(count, 2)) + 1j * generator.normal(size=(count, 2)))


def cycles(generator, count, lowest=0.02, highest=0.15):
    length, angle = generator.uniform(lowest, highest, count), generator.uniform(0, 2 * np.pi, count)
    return np.column_stack([length * np.cos(angle), length * np.sin(angle)])


def passed(swing, cycles_per_px, variance_px2, shift_px):
    """A swing after a Gaussian filter and a displacement: the Fourier transform's theorems."""
    attenuation = np.exp(-2 * np.pi**2 * variance_px2 * np.sum(cycles_per_px**2, axis=1))
    return swing * (attenuation * np.exp(2j * np.pi * cycles_per_px @ shift_px))[:, None]


def as_complex(correction):
    return correction.swing[..., 0] - 1j * correction.swing[..., 1]


def test_chroma_that_is_as_expected_asks_for_no_correction():
    generator = np.random.default_rng(1)
    frequency, expected = cycles(generator, 30), swings(generator, 30, 0.05)
    stored = passed(expected, frequency, 0.5, np.zeros(2))
    correction = chroma_correction(stored, expected, np.zeros((30, 2)), frequency, NOWHERE)
    assert np.all(correction.shift == 0.0)
    assert np.abs(as_complex(correction)).max() < 0.02 * np.abs(expected).max()


@pytest.mark.parametrize("variance_px2", [0.4, 1.0, 2.0])
@pytest.mark.parametrize(
    ("shift_px", "tagged_px"),
    [((0.0, 0.0), (0.0, 0.0)), ((-0.25, 0.3), (0.0, 0.0)), ((1.5, -0.5), (1.5, -0.5)), ((0.4, 0.3), (0.5, 0.0))],
)
def test_attenuation_and_displacement_of_chroma_are_undone(variance_px2, shift_px, tagged_px):
    generator = np.random.default_rng(2)
    count = 60
    frequency, expected = cycles(generator, count, 0.02, 0.1), swings(generator, count, 0.05)
    # every fifth block's stripes have another colour than the line says
    odd = np.arange(count) % 5 == 0
    true = expected + np.where(odd[:, None], swings(generator, count, 0.03), 0.0)
    stored = passed(true, frequency, variance_px2, np.array(shift_px))
    correction = chroma_correction(stored, expected, np.zeros((count, 2)), frequency, np.array(tagged_px))
    left = expected + as_complex(correction) - true
    assert np.sqrt(np.mean(np.abs(left[odd]) ** 2)) < 0.3 * np.sqrt(np.mean(np.abs((true - expected)[odd]) ** 2))
    assert np.sqrt(np.mean(np.abs(left[~odd]) ** 2)) < 0.1 * np.sqrt(np.mean(np.abs(expected[~odd]) ** 2))


def test_what_the_codec_dropped_is_inferred_and_not_trusted():
    generator = np.random.default_rng(3)
    frequency, expected = cycles(generator, 40, 0.02, 0.45), swings(generator, 40, 0.02)
    stored = passed(expected, frequency, 1.5, np.zeros(2))
    correction = chroma_correction(stored, expected, np.zeros((40, 2)), frequency, NOWHERE)
    fine, coarse = np.hypot(*frequency.T) > 0.4, np.hypot(*frequency.T) < 0.1
    assert np.all((correction.trust >= 0.0) & (correction.trust <= 1.0))
    assert correction.trust[fine].max() < 0.1
    assert correction.trust[coarse].min() > 0.8
    # what is inferred stays near what was expected, instead of noise blown up
    noise = swings(generator, 40, 0.3 / 224)
    noisy = chroma_correction(stored + noise, expected, np.zeros((40, 2)), frequency, NOWHERE)
    assert np.abs(as_complex(noisy)[fine]).max() < np.abs(noise).max()


def test_a_mean_is_corrected_everywhere_a_swing_only_where_stripes_are():
    generator = np.random.default_rng(4)
    frequency = np.zeros((6, 2))
    mean = generator.normal(size=(6, 2)) * 0.02
    correction = chroma_correction(swings(generator, 6, 0.05), swings(generator, 6, 0.05), mean, frequency, NOWHERE)
    np.testing.assert_allclose(correction.shift, mean)
    assert np.all(correction.swing == 0.0)


def test_no_colour_at_all_is_left_alone():
    frequency = cycles(np.random.default_rng(5), 8)
    grey = np.zeros((8, 2), complex)
    correction = chroma_correction(grey, grey, np.zeros((8, 2)), frequency, NOWHERE)
    assert np.all(correction.swing == 0.0)
    assert np.all(np.isfinite(correction.trust))
