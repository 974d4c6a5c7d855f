"""Errors of which a share is new in every frame, averaged over time: what is left of them, and what is said of it."""

import numpy as np
import pytest

from arlight.estimation.common_error import CommonError
from arlight.estimation.memory import FadingMemory

FRAME_S, MEMORY_S, SIZE = 0.04, 2.0, 40
SIGMA = 0.03
COVARIANCE = SIGMA**2 * np.tile(np.eye(SIZE), (3, 1, 1))
TRUTH = np.random.default_rng(0).normal(size=(3, SIZE))


def errors(independent, lasting_s, frames, seed=1):
    """Errors (3, SIZE) of each frame: a share of their variance is new, the rest dies away in a time."""
    generator = np.random.default_rng(seed)
    kept = np.exp(-FRAME_S / lasting_s)
    common = generator.normal(size=(3, SIZE))
    for _ in range(frames):
        common = kept * common + np.sqrt(1.0 - kept**2) * generator.normal(size=common.shape)
        new = generator.normal(size=common.shape)
        yield SIGMA * (np.sqrt(independent) * new + np.sqrt(1.0 - independent) * common)


def averaged(strayed, drift=0.0, stated=COVARIANCE):
    """A mean over frames with the given errors, and what has been learnt beside it.

    Returns:
        The learner, the mean, and mean squared errors over stated variances, one a frame of the second half.
    """
    memory, common = FadingMemory(MEMORY_S, trend=False), CommonError(MEMORY_S, 1)
    strayed = list(strayed)
    ratios = []
    for number, error in enumerate(strayed):
        truth = TRUTH + drift * number * FRAME_S
        values = truth + error
        if number == 0:
            memory.start(values, stated, np.ones((3, SIZE)))
            common.start(values, stated)
            continue
        memory.predict(FRAME_S, np.full((3, SIZE), 10.0))
        common.learn(values, stated, (memory,), FRAME_S)
        memory.correct(values, stated)
        if number > len(strayed) // 2:
            said = np.einsum("cii->ci", common.covariance(0, memory.averaged))[:, 1:]
            ratios.append(np.mean((memory.values - truth)[:, 1:] ** 2) / said.mean())
    return common, memory, np.array(ratios)


@pytest.mark.parametrize("independent", [0.1, 0.5, 1.0])
def test_the_independent_share_is_learnt(independent):
    common, _, _ = averaged(errors(independent, 3.0, 200))
    assert common.independent == pytest.approx(independent, abs=0.1)


@pytest.mark.parametrize("independent", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("lasting_s", [0.3, 2.0])
def test_the_mean_errs_as_is_said_however_fast_the_errors_die_away(independent, lasting_s):
    _, _, ratios = averaged(errors(independent, lasting_s, 400))
    # variances; the shares are averages over a second, and lasting errors are few in eight seconds
    assert 0.5 < np.mean(ratios) < 1.6


def test_errors_that_never_change_are_not_averaged_away():
    common, memory, _ = averaged(errors(0.0, 1e6, 200))
    said = np.einsum("cii->ci", common.covariance(0, memory.averaged)).mean()
    # nothing shows them, so a part of them is assumed: far more than averaging 100 frames would leave
    assert said > 0.15 * SIGMA**2
    assert said > 5.0 * np.einsum("cii->ci", memory.averaged).mean()


def test_independent_errors_leave_what_averaging_leaves():
    common, memory, _ = averaged(errors(1.0, 1.0, 400))
    said = np.einsum("cii->ci", common.covariance(0, memory.averaged)).mean()
    left = np.einsum("cii->ci", memory.averaged).mean()
    # the share is learnt to a few per cent of a frame's variance, of which averaging leaves one
    assert left * 0.9 < said < left + 0.01 * SIGMA**2
    assert left == pytest.approx(0.01 * SIGMA**2, rel=0.1)


def test_a_mean_that_lags_behind_the_light_says_so():
    steady, following = (averaged(errors(1.0, 1.0, 150), drift=drift) for drift in (0.0, 0.1))
    lag = np.mean((following[1].values - TRUTH - 0.1 * 149 * FRAME_S) ** 2)
    said = [np.einsum("cii->ci", c.covariance(0, m.averaged)).mean() for c, m, _ in (steady, following)]
    assert lag > 5.0 * said[0]
    assert said[1] == pytest.approx(lag, rel=0.4)


def test_steady_motion_of_the_light_is_not_taken_for_independent_errors():
    still, moving = (averaged(errors(0.1, 5.0, 150), drift=drift)[0].independent for drift in (0.0, 0.3))
    assert moving == pytest.approx(still, abs=0.02)


def test_the_exposures_level_is_not_judged():
    strayed = list(errors(0.5, 1.0, 100))
    jumping = [error + np.where(np.arange(SIZE) == 0, 5.0 * (number % 2), 0.0) for number, error in enumerate(strayed)]
    assert averaged(jumping)[0].independent == pytest.approx(averaged(strayed)[0].independent)


def test_forgetting_begins_again_and_another_light_does_not():
    common, _, _ = averaged(errors(0.2, 3.0, 200))
    learnt = common.independent
    common.start(TRUTH, COVARIANCE)
    assert common.independent == learnt
    common.reset()
    common.start(TRUTH, COVARIANCE)
    assert common.independent == 0.0


def test_covariances_stay_positive_and_symmetric():
    factors = np.random.default_rng(5).normal(size=(3, SIZE, 2 * SIZE))
    stated = SIGMA**2 * factors @ factors.swapaxes(1, 2) / (2 * SIZE)
    common, memory, _ = averaged(errors(0.5, 1.0, 60), stated=stated)
    said = common.covariance(0, memory.averaged)
    np.testing.assert_allclose(said, said.swapaxes(1, 2), atol=1e-12)
    assert np.linalg.eigvalsh(said).min() > 0.0
