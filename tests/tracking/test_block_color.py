"""Chroma from luma along a line in linear light, and the corrections that the stored chroma asks for."""

import numpy as np
import pytest

from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.tracking import block_kernels as kernels
from arlight.tracking.block_color import chroma_correction, color_lines
from arlight.tracking.block_means import BlockColors
from arlight.video.pixel_format import PixelFormat

BT709 = PixelFormat("bt709", False, 8)
YCC_FROM_RGB = BT709.ycc_from_rgb().astype(float)
RGB_FROM_YCC = BT709.rgb_from_ycc().astype(float)
COLORS = BlockColors(
    dark=np.array([[0.01, 0.012, 0.02], [0.002, 0.002, 0.002], [0.05, 0.02, 0.01]]),
    slope=np.array([[0.9, 0.5, 0.15], [0.3, 0.3, 0.3], [0.02, 0.1, 0.3]]),
)
TRANSFERS = ["srgb", "bt709", "gamma22", "hlg", "linear"]


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_nodes_lie_on_the_line(transfer):
    luma, chroma = color_lines(COLORS, transfer, YCC_FROM_RGB)
    assert np.all(np.diff(luma, axis=1) >= 0.0)
    encoded = np.concatenate([luma[..., None], chroma], axis=-1) @ RGB_FROM_YCC.T
    linear = linear_from_encoded(encoded, transfer)
    away = linear - COLORS.dark[:, None]
    along = away / COLORS.slope[:, None]
    inside = linear.max(axis=-1) < 0.99
    assert np.all(np.ptp(along[inside], axis=-1) < 2e-3 / COLORS.slope.min())
    np.testing.assert_allclose(linear[:, 0], COLORS.dark, atol=2e-4)
    # the brightest channel's whole range is covered
    assert np.all(linear.max(axis=(1, 2)) > 0.99)


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_chroma_of_pixels_on_the_line_is_known_from_their_luma(transfer):
    shares = np.linspace(0.0, 1.0, 101) * 0.95
    reach = (1.0 - COLORS.dark.max(axis=1)) / COLORS.slope.max(axis=1)
    linear = COLORS.dark[:, None] + (shares * reach[:, None])[..., None] * COLORS.slope[:, None]
    ycc = encoded_from_linear(linear, transfer).astype(float).reshape(-1, 3) @ YCC_FROM_RGB.T
    expected = np.empty((len(ycc), 2))
    first = np.arange(len(COLORS.dark) + 1) * len(shares)
    kernels.expected_chroma(ycc, first, *color_lines(COLORS, transfer, YCC_FROM_RGB), expected)
    # a level of eight bits is 1/224; the line between nodes bends by less than half of one
    np.testing.assert_allclose(expected, ycc[:, 1:], atol=0.5 / 224)


def test_a_colour_line_has_no_length():
    longer = BlockColors(COLORS.dark, COLORS.slope * np.array([[2.0], [0.1], [30.0]]))
    for one, other in zip(
        color_lines(COLORS, "srgb", YCC_FROM_RGB), color_lines(longer, "srgb", YCC_FROM_RGB), strict=True
    ):
        np.testing.assert_allclose(one, other, atol=1e-6)


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
    correction = chroma_correction(stored, expected, np.zeros((30, 2)), frequency)
    assert np.all(correction.shift == 0.0)
    assert np.abs(as_complex(correction)).max() < 0.02 * np.abs(expected).max()


@pytest.mark.parametrize("variance_px2", [0.4, 1.0, 2.0])
@pytest.mark.parametrize("shift_px", [(0.0, 0.0), (0.5, 0.0), (-0.25, 0.4)])
def test_attenuation_and_displacement_of_chroma_are_undone(variance_px2, shift_px):
    generator = np.random.default_rng(2)
    count = 60
    frequency, expected = cycles(generator, count, 0.02, 0.1), swings(generator, count, 0.05)
    # every fifth block's stripes have another colour than the line says
    odd = np.arange(count) % 5 == 0
    true = expected + np.where(odd[:, None], swings(generator, count, 0.03), 0.0)
    stored = passed(true, frequency, variance_px2, np.array(shift_px))
    correction = chroma_correction(stored, expected, np.zeros((count, 2)), frequency)
    left = expected + as_complex(correction) - true
    assert np.sqrt(np.mean(np.abs(left[odd]) ** 2)) < 0.3 * np.sqrt(np.mean(np.abs((true - expected)[odd]) ** 2))
    assert np.sqrt(np.mean(np.abs(left[~odd]) ** 2)) < 0.1 * np.sqrt(np.mean(np.abs(expected[~odd]) ** 2))


def test_what_the_codec_dropped_is_inferred_and_not_trusted():
    generator = np.random.default_rng(3)
    frequency, expected = cycles(generator, 40, 0.02, 0.45), swings(generator, 40, 0.02)
    stored = passed(expected, frequency, 1.5, np.zeros(2))
    correction = chroma_correction(stored, expected, np.zeros((40, 2)), frequency)
    fine, coarse = np.hypot(*frequency.T) > 0.4, np.hypot(*frequency.T) < 0.1
    assert np.all((correction.trust >= 0.0) & (correction.trust <= 1.0))
    assert correction.trust[fine].max() < 0.1
    assert correction.trust[coarse].min() > 0.8
    # what is inferred stays near what was expected, instead of noise blown up
    noise = swings(generator, 40, 0.3 / 224)
    noisy = chroma_correction(stored + noise, expected, np.zeros((40, 2)), frequency)
    assert np.abs(as_complex(noisy)[fine]).max() < np.abs(noise).max()


def test_a_mean_is_corrected_everywhere_a_swing_only_where_stripes_are():
    generator = np.random.default_rng(4)
    frequency = np.zeros((6, 2))
    mean = generator.normal(size=(6, 2)) * 0.02
    correction = chroma_correction(swings(generator, 6, 0.05), swings(generator, 6, 0.05), mean, frequency)
    np.testing.assert_allclose(correction.shift, mean)
    assert np.all(correction.swing == 0.0)


def test_no_colour_at_all_is_left_alone():
    frequency = cycles(np.random.default_rng(5), 8)
    grey = np.zeros((8, 2), complex)
    correction = chroma_correction(grey, grey, np.zeros((8, 2)), frequency)
    assert np.all(correction.swing == 0.0)
    assert np.all(np.isfinite(correction.trust))
