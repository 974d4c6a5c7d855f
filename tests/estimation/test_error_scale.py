"""The scale of the model's errors, found again from rows whose errors are of known variance."""

import numpy as np
import pytest

from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.response import optical_transfer
from arlight.estimation.row_noise import row_noise

GREEN = 1
QUIET = {"sigma": 8e-4, "samples": 20_000}
"""Pixels whose noise is a small part of the rows' errors."""
ALIKE = np.array([5.0, *[14.0] * 6])
"""Variance of the model's errors, relative to the part of it that leaves a residual."""


@pytest.fixture(scope="module")
def estimator(probe):
    return LightingEstimator(probe)


@pytest.fixture(scope="module")
def stray(blank, lit, random_light):
    """Measurements whose model errs by a factor on the usual variance, beside what all blocks share; a frame a seed."""
    means = lit(blank(**QUIET), random_light(0))
    white = float(means.values[:, 0, GREEN].max())
    noise = row_noise(
        means, GREEN, white, np.full(len(means.valid), 0.0012), optical_transfer(means.cycles_per_px, 0.4)
    )

    model = noise.model + (0.0008 * white) ** 2 * (np.arange(7) == 0)

    def measure(scale, seed):
        rows = np.array(scale)[[0, 1, 1, 1, 1, 1, 1]]
        deviation = np.sqrt(rows * model / ALIKE)
        errors = np.random.default_rng(seed).normal(size=deviation.shape) * deviation
        errors[:, 1:] *= (means.harmonics > 0)[:, None]
        measured = lit(blank(**QUIET), random_light(0), noise_seed=seed)
        measured.values[:] += errors[..., None]
        return measured

    return measure


def settled(estimator, measure, start=(1.0, 1.0), frames=120):
    nuisance = Nuisance.guess(error_scale=(start,) * 3)
    for frame in range(frames):
        nuisance = estimator.estimate(measure(frame), 0.0, nuisance).nuisance
    return np.array(nuisance.error_scale)


@pytest.mark.parametrize("truth", [(0.3, 0.3), (1.0, 4.0), (4.0, 0.5)])
def test_scales_are_found_from_wherever_they_start(estimator, stray, truth):
    low, high = (settled(estimator, lambda seed: stray(truth, seed), start) for start in ((0.01, 8.0), (8.0, 0.01)))
    np.testing.assert_allclose(low, high, rtol=0.1)
    # chance is guarded against, and errors of the few dozen means pass for lamps in part
    assert 0.4 * truth[1] < low[GREEN, 1] < 1.2 * truth[1]
    assert 0.1 * truth[0] < low[GREEN, 0] < 1.2 * truth[0]


def test_scales_of_the_harmonics_are_those_of_the_errors_variance(estimator, stray):
    one, other = (settled(estimator, lambda seed, f=f: stray((f, f), seed))[:, 1] for f in (1.0, 4.0))
    np.testing.assert_allclose(other, 4.0 * one, rtol=0.1)


def test_the_pixels_noise_is_not_blamed_on_the_model(estimator, blank, lit, random_light):
    found = settled(estimator, lambda seed: lit(blank(**QUIET), random_light(1), noise_seed=seed))
    assert np.all(found < 0.4)


def test_larger_errors_make_larger_scales(estimator, stray):
    found = np.array([settled(estimator, lambda seed, f=f: stray((f, f), seed)) for f in (0.1, 0.5, 2.0, 8.0)])
    assert np.all(np.diff(found[:, GREEN], axis=0) > 0.0)
    assert np.all(np.diff(found[:, :, 1], axis=0) > 0.0)


def test_scales_stay_finite_on_absurd_rows(estimator, blank):
    means = blank()
    for factor in (0.0, 1.0, 1e3):
        means.values[:] = factor * np.random.default_rng(0).normal(size=means.values.shape)
        found = settled(estimator, lambda _: means, frames=10)
        assert np.all((found > 0.0) & (found <= 10.0))
