"""Errors of which a share is new in every frame, averaged over time: what is left of them, and what is said of it."""

import numpy as np
import pytest

from arlight.estimation.common_error import CommonError
from arlight.estimation.memory import FadingMemory
from arlight.estimation.relative_light import RelativeLight

FRAME_S, MEMORY_S, SIZE = 0.04, 2.0, 40
SIGMA = 0.03
VARIANCE = np.full((3, SIZE), SIGMA**2)
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


def averaged(strayed, drift=0.0):
    """A mean over frames with the given errors, and what has been learnt beside it.

    Returns:
        The learner, the mean, and mean squared errors over stated variances, one a frame of the second half.
    """
    memory, common = FadingMemory(MEMORY_S, 3, SIZE, trend=False), CommonError(1, 3, SIZE)
    frame = RelativeLight(3, SIZE)
    frame.variance[:] = VARIANCE
    strayed = list(strayed)
    ratios = []
    for number, error in enumerate(strayed):
        truth = TRUTH + drift * number * FRAME_S
        frame.values[:] = truth + error
        if number == 0:
            memory.start(frame.values, VARIANCE, np.ones((3, SIZE)))
            common.start(frame)
            continue
        memory.predict(FRAME_S, np.full((3, SIZE), 10.0))
        _, shown, kept = memory.judge(frame)
        common.learn(frame, [shown], [kept * memory.averaged], FRAME_S)
        memory.correct(frame.values - memory.values, frame)
        if number > len(strayed) // 2:
            ratios.append(np.mean((memory.values - truth)[:, 1:] ** 2) / said(common, memory))
    return common, memory, np.array(ratios)


def said(common, memory):
    """Variance that is told of a mean's error."""
    told = RelativeLight(3, SIZE)
    memory.tell(told, 1.0, common.independent, common.left(0), VARIANCE)
    return told.variance[:, 1:].mean()


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
    # nothing shows them, so a part of them is assumed: far more than averaging 100 frames would leave
    assert said(common, memory) > 0.15 * SIGMA**2
    assert said(common, memory) > 5.0 * memory.averaged * memory.corrected.mean()


def test_independent_errors_leave_what_averaging_leaves():
    common, memory, _ = averaged(errors(1.0, 1.0, 400))
    left = memory.averaged * memory.corrected.mean()
    # the share is learnt to a few per cent of a frame's variance, of which averaging leaves one
    assert left * 0.9 < said(common, memory) < left + 0.01 * SIGMA**2
    assert left == pytest.approx(0.01 * SIGMA**2, rel=0.1)


def test_a_mean_that_lags_behind_the_light_says_so():
    steady, following = (averaged(errors(1.0, 1.0, 150), drift=drift) for drift in (0.0, 0.1))
    lag = np.mean((following[1].values - TRUTH - 0.1 * 149 * FRAME_S) ** 2)
    told = [said(common, memory) for common, memory, _ in (steady, following)]
    assert lag > 5.0 * told[0]
    assert told[1] == pytest.approx(lag, rel=0.4)


def test_steady_motion_of_the_light_is_not_taken_for_independent_errors():
    still, moving = (averaged(errors(0.1, 5.0, 150), drift=drift)[0].independent for drift in (0.0, 0.3))
    assert moving == pytest.approx(still, abs=0.02)


def test_the_exposures_level_is_not_judged():
    strayed = list(errors(0.5, 1.0, 100))
    jumping = [error + np.where(np.arange(SIZE) == 0, 5.0 * (number % 2), 0.0) for number, error in enumerate(strayed)]
    assert averaged(jumping)[0].independent == pytest.approx(averaged(strayed)[0].independent)


def test_another_light_does_not_change_what_errors_are_like():
    common, _, _ = averaged(errors(0.2, 3.0, 200))
    learnt, frame = common.independent, RelativeLight(3, SIZE)
    frame.values[:], frame.variance[:] = TRUTH, VARIANCE
    common.start(frame)
    assert common.independent == learnt


def test_shares_are_those_of_second_differences_written_out():
    generator = np.random.default_rng(5)
    values, variances = generator.normal(size=(5, 3, SIZE)), generator.uniform(0.5, 2.0, (5, 3, SIZE))
    common, frame = CommonError(1, 3, SIZE), RelativeLight(3, SIZE)
    shares = []
    for number in range(5):
        frame.values[:], frame.variance[:] = 0.3 * values[number], variances[number]
        if number == 0:
            common.start(frame)
            continue
        common.learn(frame, [1.0], [0.5], 10.0)
        if number >= 2:
            bent = 0.3 * (values[number] - 2.0 * values[number - 1] + values[number - 2])
            own = variances[number] + 4.0 * variances[number - 1] + variances[number - 2]
            shares.append(np.mean((bent**2 / own)[:, 1:]))
    # frames ten seconds apart: the last one counts
    assert common.independent == pytest.approx(shares[-1], rel=1e-3)
