"""Blur, sharpness, lower face and shift: what they do to stripes, and that a step finds them."""

import numpy as np
import pytest

from arlight.estimation.nuisance import Nuisance
from arlight.estimation.response import optical_transfer

CYCLES = np.random.default_rng(0).uniform(-0.2, 0.2, (12, 2))


def stripes(rows, phase, x=0.0, y=0.0):
    """Values of the rows' stripes at a phase of the pattern, moved by (x, y) pixels."""
    turned = phase - 2.0 * np.pi * (CYCLES @ np.array([x, y]))
    waves = [np.ones_like(turned)] + [f(m * turned) for m in (1, 2, 3) for f in (np.cos, np.sin)]
    return np.sum(rows * np.stack(waves, axis=1), axis=1)


def test_shifted_rows_are_those_of_shifted_stripes():
    rows = np.random.default_rng(1).normal(size=(len(CYCLES), 7))
    shifted = Nuisance(shift_px=(0.3, -0.2)).shifted(rows, CYCLES)
    for phase in (0.0, 0.7, 2.9):
        np.testing.assert_allclose(stripes(shifted, phase), stripes(rows, phase, 0.3, -0.2), rtol=1e-9, atol=1e-12)


def test_shifting_columns_shifts_each():
    rows = np.random.default_rng(2).normal(size=(len(CYCLES), 7, 3))
    nuisance = Nuisance(shift_px=(0.1, 0.2))
    together = nuisance.shifted(rows, CYCLES)
    for column in range(3):
        np.testing.assert_array_equal(together[..., column], nuisance.shifted(rows[..., column], CYCLES))


def test_a_picture_without_more_is_blurred_as_a_gaussian():
    np.testing.assert_array_equal(Nuisance(0.7).transfer(CYCLES), optical_transfer(CYCLES, 0.7))


def test_sharpness_is_that_of_a_kernel_of_three_pixels():
    # a blur that is made of pixels is no Gaussian: 1 - 4 a sin^2(pi nu) along each axis
    a, cycles = 0.08, np.array([[nu, 0.0] for nu in np.linspace(0.02, 0.15, 20)])
    pixels = np.sinc(cycles[:, 0]) * (1.0 - 4.0 * a * np.sin(np.pi * cycles[:, 0]) ** 2)
    # to fourth order: 4 a (pi nu)^2 = 2 a k^2 / 2 with k = 2 pi nu, and a (1/12 - a/2) k^4 beyond it
    quartic = Nuisance(2.0 * a, sharpness_px4=a * (1.0 / 12.0 - a / 2.0)).transfer(cycles)[:, 1]
    gaussian = Nuisance(2.0 * a).transfer(cycles)[:, 1]
    assert np.abs(quartic / pixels - 1.0).max() < 0.1 * np.abs(gaussian / pixels - 1.0).max()


@pytest.mark.parametrize("place", range(5))
def test_slopes_are_derivatives(place):
    rows = np.random.default_rng(3).normal(size=(len(CYCLES), 7))
    mirrored = np.random.default_rng(4).normal(size=(len(CYCLES), 7))

    def predicted(change):
        values = np.array([0.5, 0.001, 0.8, 0.05, -0.03])
        values[place] += change
        nuisance = Nuisance(values[0], lower_face=values[2], sharpness_px4=values[1], shift_px=tuple(values[3:]))
        return nuisance.shifted((rows + nuisance.lower_face * mirrored) * nuisance.transfer(CYCLES)[:], CYCLES)

    step = 1e-6
    numeric = (predicted(step) - predicted(-step)) / (2.0 * step)
    now = Nuisance(0.5, lower_face=0.8, sharpness_px4=0.001, shift_px=(0.05, -0.03))
    seen = now.shifted(mirrored * now.transfer(CYCLES), CYCLES)
    slopes = now.slopes(predicted(0.0), seen, CYCLES)
    np.testing.assert_allclose(slopes[..., place], numeric, rtol=1e-4, atol=1e-7)


def test_nothing_known_leaves_the_first_guess():
    start = Nuisance(0.9, 0.6)
    stepped, covariance = start.stepped(np.zeros((5, 5)), np.zeros(5))
    assert stepped == start
    assert np.all(np.diagonal(covariance) > 0.0)


def test_steps_stay_within_what_pictures_do():
    wild, covariance = Nuisance().stepped(np.eye(5) * 1e6, np.full(5, 1e9))
    assert wild.blur_variance_px2 <= 6.0
    assert wild.lower_face <= 1.5
    assert max(np.abs(wild.shift_px)) <= 0.3
    assert np.all(np.isfinite(Nuisance.transfer(wild, 10.0 * CYCLES)))
    assert np.all(np.diagonal(covariance) <= 1e-6)
