"""Honest, narrow and wide error bars are told apart, with correlations and without."""

import numpy as np
import pytest

from arlight.benchmark.consistency import consistency, logged_consistency
from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies, unpack_real

FREQUENCIES = half_plane_frequencies(2)
SIZE = 2 * len(FREQUENCIES) - 1
FRAMES = 400


def run(narrow=1.0, diagonal=False, only=slice(None)):
    """Estimates whose errors have `narrow` times the variance that is reported of the chosen unknowns."""
    generator = np.random.default_rng(3)
    factors = generator.normal(size=(3, SIZE, SIZE + 2))
    covariance = factors @ factors.swapaxes(1, 2)
    widen = np.ones(SIZE)
    widen[only] = np.sqrt(narrow)
    reported = np.stack([np.diag(np.diagonal(c)) for c in covariance]) if diagonal else covariance
    true = unpack_real(generator.normal(size=(SIZE, 3)))
    estimates = []
    for frame in range(FRAMES):
        noise = np.einsum("cij,cj->ic", np.linalg.cholesky(covariance), generator.normal(size=(3, SIZE)))
        wrong = unpack_real(widen[:, None] * noise)
        estimates.append(Lighting(FREQUENCIES, true + wrong, reported, 0.04 * frame, 1.0))
    return estimates, [true] * FRAMES


@pytest.mark.parametrize("narrow", [0.25, 1.0, 4.0])
def test_it_is_the_ratio_of_true_to_reported_variance(narrow):
    found = consistency(*run(narrow))
    # 400 frames of 3 * 13 unknowns: known to 1.2 %
    assert found.full == pytest.approx(narrow, rel=0.05)
    assert found.diagonal == pytest.approx(narrow, rel=0.1)
    assert found.frames == FRAMES


def test_correlations_that_are_not_reported_show_in_the_spread_of_frames():
    honest, cut = consistency(*run()), consistency(*run(diagonal=True))
    assert cut.diagonal == pytest.approx(honest.diagonal)
    assert cut.spread > 1.3 * honest.spread


def test_each_order_is_judged_by_itself():
    found = consistency(*run(9.0, only=slice(0, 1)))
    assert found.by_order[0] == pytest.approx(9.0, rel=0.15)
    assert found.by_order[1] == pytest.approx(1.0, rel=0.15)
    assert found.by_order[2] == pytest.approx(1.0, rel=0.15)


def test_a_log_tells_the_same_without_correlations():
    estimates, truths = run(2.0)
    estimated, stddev = (np.stack([getattr(e, name) for e in estimates]) for name in ("coefficients", "stddev"))
    found = logged_consistency(estimated, stddev, np.stack(truths))
    assert found == pytest.approx(2.0, rel=0.1)
    estimated[5] = np.nan
    assert logged_consistency(estimated, stddev, np.stack(truths)) == pytest.approx(found, rel=0.02)


def test_nothing_to_judge_is_nan():
    assert np.isnan(consistency([], []).full)
    nothing = np.full((2, len(FREQUENCIES), 3), np.nan)
    assert np.isnan(logged_consistency(nothing, nothing.real, nothing))
