"""The scale of the model's errors, found again from residuals of known variance."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.error_scale import next_scales, row_scale
from arlight.estimation.row_noise import RowNoise

BLOCKS, ROWS = 300, 7
PIXELS, MODEL = 1e-7, 4e-6
NOTHING = np.zeros(BLOCKS)


def noise_of(pixels=PIXELS, model=MODEL):
    """Rows with independent pixel noise and a model's error of the usual size."""
    return RowNoise(
        pixels * np.tile(np.eye(ROWS), (BLOCKS, 1, 1)), np.full((BLOCKS, ROWS), model), np.zeros((BLOCKS, ROWS)),
        np.ones((BLOCKS, ROWS)), True,
    )  # fmt: skip


def residuals(noise, scale, seed=0):
    """Residuals where the model's errors are `scale` times the usual, beside those that all blocks share."""
    deviation = np.sqrt(noise.residual_variance(row_scale(scale)))
    return np.random.default_rng(seed).normal(size=deviation.shape) * deviation


def settled(noise, missed, start=(1.0, 1.0), usable=None, frames=150):
    """Scales after as many frames, where nothing is fitted: residuals are the errors."""
    usable = np.ones((BLOCKS, ROWS), bool) if usable is None else usable
    scale = start
    for _ in range(frames):
        precision = noise.precision(row_scale(scale), usable)
        pull = np.einsum("brs,bs->br", precision, missed)
        scale = next_scales(scale, noise, 0.0, NOTHING, usable, pull, precision)
    return scale


@pytest.mark.parametrize("truth", [(0.3, 0.3), (1.0, 4.0), (5.0, 0.5)])
def test_scales_are_found_from_wherever_they_start(truth):
    noise = noise_of()
    missed = residuals(noise, truth)
    low, high = settled(noise, missed, (0.01, 8.0)), settled(noise, missed, (8.0, 0.01))
    np.testing.assert_allclose(low, high, rtol=0.02)
    # 300 means and 1800 harmonics, of whose errors pixels make a part, and the guard against chance
    np.testing.assert_allclose(low, truth, rtol=0.35)


def test_the_pixels_noise_is_not_blamed_on_the_model():
    noise = noise_of()
    assert max(settled(noise, residuals(noise, (0.0, 0.0)))) < 0.15


def test_larger_errors_never_make_a_smaller_scale():
    noise = noise_of()
    missed = residuals(noise, (1.0, 1.0))
    scales = np.array([settled(noise, factor * missed) for factor in (0.5, 1.0, 2.0, 4.0)])
    assert np.all(np.diff(scales, axis=0) > 0.0)


def test_what_a_fit_has_taken_of_the_residuals_is_given_back():
    noise, truth = noise_of(), (1.0, 1.0)
    usable = np.ones((BLOCKS, ROWS), bool)
    usable[:, 0] = False
    precision = noise.precision(row_scale(truth), usable)
    # two unknowns for the six harmonics of each block
    design = np.random.default_rng(3).normal(size=(BLOCKS, ROWS, 2))
    weighted = precision @ design
    inverse = np.linalg.inv(np.swapaxes(design, 1, 2) @ weighted)
    left = precision - weighted @ inverse @ np.swapaxes(weighted, 1, 2)
    pull = np.einsum("brs,bs->br", left, residuals(noise, truth))
    _, fair = next_scales(truth, noise, 0.0, NOTHING, usable, pull, left)
    _, careless = next_scales(truth, noise, 0.0, NOTHING, usable, pull, precision)
    assert fair == pytest.approx(1.0, abs=0.06)
    assert careless == pytest.approx(np.sqrt(4 / 6), abs=0.06)


def test_brighter_light_leaves_the_scales_alone():
    noise, brighter = noise_of(), noise_of(9.0 * PIXELS, 9.0 * MODEL)
    missed = residuals(noise, (2.0, 0.6))
    np.testing.assert_allclose(settled(brighter, 3.0 * missed), settled(noise, missed), rtol=1e-9)


def test_rows_that_were_not_fitted_or_only_inferred_have_no_say():
    noise = noise_of()
    missed = residuals(noise, (1.0, 1.0))
    usable = np.ones((BLOCKS, ROWS), bool)
    usable[::4, 3:] = False
    expected = settled(noise, missed, usable=usable)
    spoilt = np.where(usable, missed, 1.0)
    np.testing.assert_allclose(settled(noise, spoilt, usable=usable), expected)
    inferred = replace(noise, trust=np.where(usable, 1.0, 0.2))
    everything = np.ones_like(usable)
    precision = inferred.precision(row_scale((1.0, 1.0)), everything)
    calm, wild = (
        next_scales((1.0, 1.0), inferred, 0.0, NOTHING, everything, np.where(usable, 1.0, pull), precision)
        for pull in (0.0, 1e6)
    )
    assert calm == wild


def test_a_lamps_extra_is_an_error_of_the_means_alone():
    noise = noise_of()
    usable = np.ones((BLOCKS, ROWS), bool)
    precision = noise.precision(row_scale((1.0, 1.0)), usable)
    pull = np.einsum("brs,bs->br", precision, residuals(noise, (3.0, 3.0)))
    without = next_scales((1.0, 1.0), noise, 0.0, NOTHING, usable, pull, precision)
    lamps = next_scales((1.0, 1.0), noise, 1e-5, np.full(BLOCKS, 1e-5), usable, pull, precision)
    assert lamps[1] == without[1]
    assert lamps[0] != without[0]


def test_nothing_usable_tells_nothing():
    nothing = np.zeros((BLOCKS, ROWS), bool)
    empty = np.zeros((BLOCKS, ROWS, ROWS))
    found = next_scales((0.7, 2.0), noise_of(), 0.0, NOTHING, nothing, np.zeros((BLOCKS, ROWS)), empty)
    assert found == (0.7, 2.0)


def test_scales_stay_finite_on_absurd_residuals():
    noise = noise_of()
    missed = residuals(noise, (1.0, 1.0))
    for factor in (0.0, 1e9):
        least, most = sorted(settled(noise, factor * missed))
        assert 0.0 < least <= most <= 10.0
