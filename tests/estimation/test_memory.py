"""The fading Kalman filter against what it stands for: least squares with weights that fade exponentially."""

import numpy as np
import pytest

from arlight.estimation.memory import FadingMemory

CHANNELS, SIZE = 3, 4
ENDLESS = np.full((CHANNELS, SIZE), np.inf)


def random_covariance(generator, scale=1.0):
    factors = generator.normal(size=(CHANNELS, SIZE, SIZE + 3))
    return scale * factors @ factors.swapaxes(1, 2) / SIZE


def observations(seed, count=12):
    generator = np.random.default_rng(seed)
    times = np.cumsum(generator.uniform(0.01, 0.2, count)) - 0.01
    return times, generator.normal(size=(count, CHANNELS, SIZE)), [random_covariance(generator) for _ in range(count)]


def filtered(memory, times, values, covariances, rate=0.0):
    memory.start(values[0], covariances[0], np.full((CHANNELS, SIZE), rate))
    for before, now, value, covariance in zip(times[:-1], times[1:], values[1:], covariances[1:], strict=True):
        memory.predict(now - before, ENDLESS)
        memory.correct(value, covariance)
    return memory


@pytest.mark.parametrize("seed", range(3))
def test_without_trend_it_is_the_faded_weighted_mean(seed):
    times, values, covariances = observations(seed)
    memory = filtered(FadingMemory(0.4, trend=False), times, values, covariances)
    for c in range(CHANNELS):
        weights = [
            np.exp(-(times[-1] - t) / 0.4) * np.linalg.inv(r[c]) for t, r in zip(times, covariances, strict=True)
        ]
        covariance = np.linalg.inv(sum(weights))
        mean = covariance @ sum(w @ z[c] for w, z in zip(weights, values, strict=True))
        np.testing.assert_allclose(memory.values[c], mean, rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(memory.covariance[c], covariance, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_with_trend_it_is_the_faded_straight_line(seed):
    times, values, covariances = observations(seed)
    rate, memory_s = 2.0, 0.4
    memory = filtered(FadingMemory(memory_s, trend=True), times, values, covariances, rate)
    for c in range(CHANNELS):
        # unknown: value and slope at the last time
        normal, right = np.zeros((2 * SIZE, 2 * SIZE)), np.zeros(2 * SIZE)
        normal[SIZE:, SIZE:] = np.eye(SIZE) / rate**2 * np.exp(-(times[-1] - times[0]) / memory_s)
        for t, z, r in zip(times, values, covariances, strict=True):
            line = np.hstack([np.eye(SIZE), (t - times[-1]) * np.eye(SIZE)])
            weight = np.exp(-(times[-1] - t) / memory_s) * np.linalg.inv(r[c])
            normal += line.T @ weight @ line
            right += line.T @ weight @ z[c]
        solution, covariance = np.linalg.solve(normal, right), np.linalg.inv(normal)
        np.testing.assert_allclose(memory.values[c], solution[:SIZE], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(memory.velocity[c], solution[SIZE:], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(memory.covariance[c], covariance[:SIZE, :SIZE], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("trend", [False, True])
def test_two_steps_are_one_long_step(trend):
    generator = np.random.default_rng(4)
    values, covariance = generator.normal(size=(CHANNELS, SIZE)), random_covariance(generator)
    results = []
    for steps in ([0.3], [0.1, 0.05, 0.15]):
        memory = FadingMemory(0.5, trend=trend)
        memory.start(values, covariance, np.full((CHANNELS, SIZE), 1.5))
        for dt in (0.04, 0.04):
            memory.predict(dt, ENDLESS)
            memory.correct(values + 0.1, covariance)
        for dt in steps:
            memory.predict(dt, ENDLESS)
        results.append(memory)
    np.testing.assert_allclose(results[0].values, results[1].values, rtol=1e-9)
    np.testing.assert_allclose(results[0].covariance, results[1].covariance, rtol=1e-9)


@pytest.mark.parametrize("trend", [False, True])
def test_no_time_passes_in_a_step_of_zero(trend):
    memory = filtered(FadingMemory(0.3, trend=trend), *observations(5), 1.0)
    values, covariance = memory.values.copy(), memory.covariance.copy()
    memory.predict(0.0, ENDLESS)
    np.testing.assert_array_equal(memory.values, values)
    np.testing.assert_allclose(memory.covariance, covariance, rtol=1e-12)


def test_a_steady_change_is_followed_without_lag():
    memory = FadingMemory(0.25, trend=True)
    slope = np.random.default_rng(6).normal(size=(CHANNELS, SIZE))
    covariance = np.tile(np.eye(SIZE) * 1e-4, (CHANNELS, 1, 1))
    memory.start(0.0 * slope, covariance, np.full((CHANNELS, SIZE), 10.0))
    for step in range(1, 60):
        memory.predict(0.04, ENDLESS)
        memory.correct(0.04 * step * slope, covariance)
    np.testing.assert_allclose(memory.values, 0.04 * 59 * slope, atol=1e-5)
    np.testing.assert_allclose(memory.velocity, slope, atol=1e-4)


@pytest.mark.parametrize("trend", [False, True])
def test_variance_grows_up_to_the_ceiling_and_stays_a_covariance(trend):
    memory = filtered(FadingMemory(0.3, trend=trend), *observations(7), 1.0)
    ceiling = np.random.default_rng(8).uniform(5.0, 20.0, (CHANNELS, SIZE))
    last = np.einsum("cii->ci", memory.covariance)
    for _ in range(200):
        memory.predict(0.1, ceiling)
        variance = np.einsum("cii->ci", memory.covariance)
        assert np.all(variance <= ceiling * (1 + 1e-9))
        assert np.all(variance >= np.minimum(last, ceiling) * (1 - 1e-9))
        assert np.linalg.eigvalsh(memory.covariance).min() > -1e-9
        last = variance
    np.testing.assert_allclose(last, ceiling, rtol=1e-9)
    memory.predict(1e6, ceiling)
    assert np.all(np.isfinite(memory.covariance))


@pytest.mark.parametrize("trend", [False, True])
def test_covariance_stays_one_over_many_frames(trend):
    generator = np.random.default_rng(9)
    memory = FadingMemory(0.5, trend=trend)
    covariance = random_covariance(generator, 1e-4)
    memory.start(np.zeros((CHANNELS, SIZE)), covariance, np.ones((CHANNELS, SIZE)))
    for _ in range(2000):
        memory.predict(0.04, ENDLESS)
        memory.correct(generator.normal(size=(CHANNELS, SIZE)) * 0.01, covariance)
    np.testing.assert_array_equal(memory.covariance, memory.covariance.swapaxes(1, 2))
    assert np.linalg.eigvalsh(memory.covariance).min() > 0.0
    # the balance between old and new is that of the memory: so many frames count
    share = memory.covariance[:, 0, 0] / covariance[:, 0, 0]
    assert np.all(share < 0.25)
    assert np.all(share > 0.04)


def test_starting_again_forgets_and_does_not_touch_what_it_was_given():
    times, values, covariances = observations(10)
    used, new = FadingMemory(0.4, trend=True), FadingMemory(0.4, trend=True)
    given, given_covariance = values[0].copy(), covariances[0].copy()
    filtered(used, times, values, covariances, 3.0)
    np.testing.assert_array_equal(values[0], given)
    np.testing.assert_array_equal(covariances[0], given_covariance)
    for memory in (filtered(used, times, -values, covariances, 1.0), filtered(new, times, -values, covariances, 1.0)):
        results = memory.values, memory.covariance, memory.velocity
    np.testing.assert_array_equal(used.values, results[0])
    np.testing.assert_array_equal(used.covariance, results[1])
    np.testing.assert_array_equal(used.velocity, results[2])
