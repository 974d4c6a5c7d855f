"""The gate on real measurements whose clock is made to run: a stage that is slowed, an estimate that is spoiled."""

from dataclasses import replace

import pytest

from arlight.benchmark.speed.gate import failures
from arlight.benchmark.speed.tracking_part import measure_tracking
from arlight.benchmark.speed.yardsticks import ArucoPose
from arlight.estimation.estimator import LightingEstimator
from arlight.lighting_tracker import LightingTracker

FRAMES = 8
TICK_S = 0.001


class TickingClock:
    """Goes on by a tick whenever it is read, and by as much as a stage is made to take."""

    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        self.now_s += TICK_S
        return self.now_s


class ChangedEstimator:
    """An estimator that takes longer, or whose light is too bright in all but the mean."""

    def __init__(self, probe, clock, extra_s=0.0, gain=1.0):
        self._own, self._clock, self._extra_s, self._gain = LightingEstimator(probe), clock, extra_s, gain

    def estimate(self, means, time_s, nuisance=None, order=None):
        self._clock.now_s += self._extra_s
        estimate = self._own.estimate(means, time_s, nuisance, order)
        coefficients = estimate.lighting.coefficients.copy()
        coefficients[1:] *= self._gain
        return replace(estimate, lighting=replace(estimate.lighting, coefficients=coefficients))


@pytest.fixture(scope="module")
def measured(clip):
    """Findings with the estimator changed."""

    def measure(**change):
        def tracker(probe, camera, clock):
            estimator = ChangedEstimator(probe, clock, **change)
            return LightingTracker(probe, camera, estimator=estimator, clock=clock)

        yardstick = ArucoPose(clip.probe, clip.camera)
        return measure_tracking(clip, FRAMES, yardstick, make_tracker=tracker, clock=TickingClock())

    return measure


@pytest.fixture(scope="module")
def unchanged(measured):
    return measured()


def test_an_unchanged_run_passes(measured, unchanged):
    assert failures(measured(), unchanged) == []


def test_a_stage_that_takes_longer_fails_by_its_name(measured, unchanged):
    slowed = measured(extra_s=0.5 * TICK_S)
    assert [failure.name for failure in failures(slowed, unchanged)] == ["estimate, tiny"]


def test_a_stage_that_takes_a_little_longer_passes(measured, unchanged):
    assert failures(measured(extra_s=0.2 * TICK_S), unchanged) == []


def test_a_spoiled_estimate_fails_as_an_error_of_the_light(measured, unchanged):
    failed = {failure.name for failure in failures(measured(gain=1.5), unchanged)}
    assert failed == {"light, tiny", "light of one frame, tiny"}
