"""The fading Kalman filter against what it stands for: least squares with weights that fade exponentially."""

import numpy as np
import pytest

from arlight.estimation.memory import FadingMemory
from arlight.estimation.relative_light import RelativeLight

SHAPE = CHANNELS, SIZE = 3, 5
ENDLESS = np.full(SHAPE, np.inf)


def measurement(values, variance):
    light = RelativeLight(*SHAPE)
    light.values[:], light.variance[:] = values, variance
    return light


def observations(seed, count=12):
    generator = np.random.default_rng(seed)
    times = np.cumsum(generator.uniform(0.01, 0.2, count)) - 0.01
    return times, generator.normal(size=(count, *SHAPE)), generator.uniform(0.3, 3.0, (count, *SHAPE))


def take_in(memory, values, variance):
    memory.correct(values - memory.values, measurement(values, variance))


def filtered(memory, times, values, variances, rate=0.0):
    memory.start(values[0], variances[0], np.full(SHAPE, rate))
    for before, now, value, variance in zip(times[:-1], times[1:], values[1:], variances[1:], strict=True):
        memory.predict(now - before, ENDLESS)
        take_in(memory, value, variance)
    return memory


@pytest.mark.parametrize("seed", range(3))
def test_without_trend_it_is_the_faded_weighted_mean(seed):
    times, values, variances = observations(seed)
    memory = filtered(FadingMemory(0.4, *SHAPE, trend=False), times, values, variances)
    weights = np.exp((times - times[-1]) / 0.4)[:, None, None] / variances
    np.testing.assert_allclose(memory.values, np.sum(weights * values, axis=0) / weights.sum(axis=0), rtol=1e-8)
    np.testing.assert_allclose(memory.variance, 1.0 / weights.sum(axis=0), rtol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_with_trend_it_is_the_faded_straight_line(seed):
    times, values, variances = observations(seed)
    rate, memory_s = 2.0, 0.4
    memory = filtered(FadingMemory(memory_s, *SHAPE, trend=True), times, values, variances, rate)
    faded = np.exp((times - times[-1]) / memory_s)
    line = np.stack([np.ones_like(times), times - times[-1]], axis=1)
    for place in np.ndindex(SHAPE):
        # unknown: value and slope at the last time
        weights = faded / variances[(slice(None), *place)]
        normal = line.T @ (weights[:, None] * line) + np.diag([0.0, faded[0] / rate**2])
        solution = np.linalg.solve(normal, line.T @ (weights * values[(slice(None), *place)]))
        found = np.array([memory.values[place], memory.velocity[place]])
        np.testing.assert_allclose(found, solution, rtol=1e-7, atol=1e-9)
        spread = [[memory.variance[place], memory.cross[place]], [memory.cross[place], memory.moving[place]]]
        np.testing.assert_allclose(spread, np.linalg.inv(normal), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("trend", [False, True])
def test_two_steps_are_one_long_step(trend):
    generator = np.random.default_rng(4)
    values, variance = generator.normal(size=SHAPE), generator.uniform(0.5, 2.0, SHAPE)
    results = []
    for steps in ([0.3], [0.1, 0.05, 0.15]):
        memory = FadingMemory(0.5, *SHAPE, trend=trend)
        memory.start(values, variance, np.full(SHAPE, 1.5))
        for dt in (0.04, 0.04):
            memory.predict(dt, ENDLESS)
            take_in(memory, values + 0.1, variance)
        for dt in steps:
            memory.predict(dt, ENDLESS)
        results.append(memory)
    np.testing.assert_allclose(results[0].values, results[1].values, rtol=1e-9)
    np.testing.assert_allclose(results[0].variance, results[1].variance, rtol=1e-9)


@pytest.mark.parametrize("trend", [False, True])
def test_no_time_passes_in_a_step_of_zero(trend):
    memory = filtered(FadingMemory(0.3, *SHAPE, trend=trend), *observations(5), 1.0)
    values, variance = memory.values.copy(), memory.variance.copy()
    memory.predict(0.0, ENDLESS)
    np.testing.assert_array_equal(memory.values, values)
    np.testing.assert_allclose(memory.variance, variance, rtol=1e-12)


def test_a_steady_change_is_followed_without_lag():
    memory = FadingMemory(0.25, *SHAPE, trend=True)
    slope = np.random.default_rng(6).normal(size=SHAPE)
    variance = np.full(SHAPE, 1e-4)
    memory.start(0.0 * slope, variance, np.full(SHAPE, 10.0))
    for step in range(1, 60):
        memory.predict(0.04, ENDLESS)
        take_in(memory, 0.04 * step * slope, variance)
    np.testing.assert_allclose(memory.values, 0.04 * 59 * slope, atol=1e-5)
    np.testing.assert_allclose(memory.velocity, slope, atol=1e-4)


@pytest.mark.parametrize("trend", [False, True])
def test_variance_grows_up_to_the_ceiling(trend):
    memory = filtered(FadingMemory(0.3, *SHAPE, trend=trend), *observations(7), 1.0)
    ceiling = np.random.default_rng(8).uniform(5.0, 20.0, SHAPE)
    last = memory.variance.copy()
    for _ in range(200):
        memory.predict(0.1, ceiling)
        assert np.all(memory.variance <= ceiling * (1 + 1e-9))
        assert np.all(memory.variance >= np.minimum(last, ceiling) * (1 - 1e-9))
        # value and velocity keep a joint covariance
        assert np.all(memory.cross**2 <= memory.variance * memory.moving * (1 + 1e-9))
        last = memory.variance.copy()
    np.testing.assert_allclose(last, ceiling, rtol=1e-9)
    memory.predict(1e6, ceiling)
    assert np.all(np.isfinite(memory.variance))


@pytest.mark.parametrize("trend", [False, True])
def test_variance_stays_one_over_many_frames(trend):
    generator = np.random.default_rng(9)
    memory, variance = FadingMemory(0.5, *SHAPE, trend=trend), np.full(SHAPE, 1e-4)
    memory.start(np.zeros(SHAPE), variance, np.ones(SHAPE))
    for _ in range(2000):
        memory.predict(0.04, ENDLESS)
        take_in(memory, generator.normal(size=SHAPE) * 0.01, variance)
    # the balance between old and new is that of the memory: so many frames count
    assert np.all(memory.variance < 0.25 * variance)
    assert np.all(memory.variance > 0.04 * variance)


def test_a_measurement_is_judged_by_all_but_the_levels():
    memory = filtered(FadingMemory(0.4, *SHAPE, trend=False), *observations(11))
    generator = np.random.default_rng(12)
    measured = measurement(generator.normal(size=SHAPE), generator.uniform(0.3, 3.0, SHAPE))
    distance = ((measured.values - memory.values) ** 2)[:, 1:]
    own, before = measured.variance[:, 1:], memory.corrected[:, 1:].copy()
    memory.predict(0.1, ENDLESS)
    expected = [np.mean(distance / (own + memory.variance[:, 1:])), np.mean(distance / own), np.mean(before / own)]
    np.testing.assert_allclose(memory.judge(measured), expected, rtol=1e-12)


@pytest.mark.parametrize("trend", [False, True])
def test_what_is_told_has_the_variance_of_independent_errors(trend):
    # two hundred frames of the same weight, averaged with fading weights
    memory, variance = FadingMemory(1.0, *SHAPE, trend=trend), np.full(SHAPE, 2.0)
    memory.start(np.zeros(SHAPE), variance, np.full(SHAPE, 100.0))
    errors, generator = [], np.random.default_rng(13)
    for frame in range(2000):
        memory.predict(0.05, ENDLESS)
        take_in(memory, generator.normal(size=SHAPE) * np.sqrt(2.0), variance)
        if frame > 200:
            errors.append(memory.values.copy())
    told = measurement(np.zeros(SHAPE), np.zeros(SHAPE))
    memory.tell(told, 1.0, 1.0, 0.0, variance)
    np.testing.assert_array_equal(told.values, memory.values)
    assert np.mean(np.square(errors)) == pytest.approx(told.variance.mean(), rel=0.15)


def test_a_freed_level_is_told_as_uncertain_as_it_is():
    memory = filtered(FadingMemory(0.4, *SHAPE, trend=False), *observations(14))
    memory.free_level(1, 1e6)
    value = np.random.default_rng(15).normal(size=SHAPE)
    take_in(memory, value, np.full(SHAPE, 0.5))
    assert memory.values[1, 0] == pytest.approx(value[1, 0], rel=1e-4)
    told = measurement(np.zeros(SHAPE), np.zeros(SHAPE))
    memory.tell(told, 1.0, 1.0, 0.25, np.full(SHAPE, 0.5))
    assert told.variance[1, 0] == pytest.approx(0.5 + 0.25 * 0.5, rel=1e-4)
    np.testing.assert_allclose(told.variance[:, 1:], memory.averaged * memory.corrected[:, 1:] + 0.125, rtol=1e-12)


def test_starting_again_forgets_and_does_not_touch_what_it_was_given():
    times, values, variances = observations(10)
    used, new = (FadingMemory(0.4, *SHAPE, trend=True) for _ in range(2))
    given, given_variance = values[0].copy(), variances[0].copy()
    filtered(used, times, values, variances, 3.0)
    used.free_level(0, 1.0)
    np.testing.assert_array_equal(values[0], given)
    np.testing.assert_array_equal(variances[0], given_variance)
    results = []
    for memory in (used, new):
        filtered(memory, times, -values, variances, 1.0)
        told = measurement(np.zeros(SHAPE), np.zeros(SHAPE))
        memory.tell(told, 1.0, 0.5, 0.25, variances[0])
        results.append((memory.values, memory.variance, memory.velocity, told.variance))
    for one, other in zip(*results, strict=True):
        np.testing.assert_array_equal(one, other)
