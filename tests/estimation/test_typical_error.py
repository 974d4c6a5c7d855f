"""The filter of single numbers and correlations against the Kalman filter of the whole vector."""

import numpy as np
import pytest

from arlight.estimation.memory import FadingMemory
from arlight.estimation.relative_light import RelativeLight
from arlight.estimation.typical_error import TypicalError
from arlight.fourier import half_plane_frequencies, unpack_real

ORDERS = [0, 1, 3, 5]


def correlations(size, seed, samples):
    """(3, size, size) with ones on the diagonal; fewer samples correlate more."""
    factors = np.random.default_rng(seed).normal(size=(3, size, samples))
    matrices = factors @ factors.swapaxes(1, 2)
    deviation = np.sqrt(np.einsum("cii->ci", matrices))
    return matrices / deviation[:, :, None] / deviation[:, None, :]


class Scene:
    """A frame near an earlier one's light, and typical errors, of given covariances of relative light."""

    def __init__(self, order, seed=0):
        self.frequencies = half_plane_frequencies(order)
        self.size = 2 * len(self.frequencies) - 1
        generator = np.random.default_rng(seed)
        self.deviation = generator.uniform(0.01, 0.03, (3, self.size))
        self.values = 0.2 * generator.normal(size=(3, self.size))
        self.values[:, 0] = [1.5, 1.0, 0.7]
        self.light = RelativeLight(3, self.size)
        self.memories = tuple(FadingMemory(1.5, 3, self.size, trend=False) for _ in range(2))
        self.typical = TypicalError(1.5, self.light, self.memories)

    def covariance(self, seed, samples):
        shape = correlations(self.size, seed, self.size + samples)
        return shape * self.deviation[:, :, None] * self.deviation[:, None, :]

    def show(self, values, relative):
        """Make a frame whose relative light has these values and covariance, by slopes written out."""
        packed, absolute = values * values[:, :1], np.empty_like(relative)
        packed[:, 0] = values[:, 0]
        for c in range(3):
            slope = values[c, 0] * np.eye(self.size)
            slope[1:, 0], slope[0, 0] = values[c, 1:], 1.0
            absolute[c] = slope @ relative[c] @ slope.T
        self.light.take(unpack_real(packed.T), absolute, np.ones(3))
        self.absolute = absolute


@pytest.mark.parametrize("order", ORDERS)
def test_the_average_is_that_of_the_covariances_by_their_certainty(order):
    scene = Scene(order)
    covariances = [factor * scene.covariance(seed, 20) for seed, factor in ((1, 1.0), (2, 4.0), (3, 0.5))]
    weight, expected = 1.0, covariances[0]
    for number, covariance in enumerate(covariances):
        scene.show(scene.values, covariance)
        if number == 0:
            scene.typical.start(scene.absolute)
            continue
        scene.typical.average(scene.absolute, 0.3)
        faded = weight * np.exp(-0.3 / 1.5)
        new = 1.0 / np.mean(np.einsum("cii->ci", covariance) / np.einsum("cii->ci", expected))
        weight = faded + new
        expected = (faded * expected + new * covariance) / weight
    np.testing.assert_allclose(scene.typical.covariance, expected, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(scene.typical.diagonal, np.einsum("cii->ci", expected), rtol=1e-8)


def remember(scene, memory, known, free_levels=(0.0, 0.0, 0.0)):
    """Values whose covariance is a part of the typical one."""
    memory.start(scene.values, known * scene.deviation**2, np.ones((3, scene.size)))
    for channel, variance in enumerate(free_levels):
        memory.free_level(channel, variance)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("known", [1e-3, 0.1, 1.0, 30.0])
@pytest.mark.parametrize("free", [0.0, 1e-4, 10.0])
def test_with_one_gain_it_is_the_kalman_filter_of_the_vector(order, known, free):
    scene = Scene(order)
    typical, measured = scene.covariance(4, 10), scene.covariance(5, 10)
    scene.show(scene.values, typical)
    scene.typical.start(scene.absolute)
    found = scene.values + 2.0 * scene.deviation * np.random.default_rng(6).normal(size=scene.values.shape)
    scene.show(found, measured)
    # the second memory shares the first one's factor, which is its own where as much is known
    freedoms = ((free, 0.0, 0.5 * free), (0.0, 3.0 * free, 0.0))
    for memory, freed in zip(scene.memories, freedoms, strict=True):
        remember(scene, memory, known, freed)
    for memory, innovation, freed in zip(scene.memories, scene.typical.weigh(scene.absolute), freedoms, strict=True):
        memory.correct(innovation, scene.light)
        for c in range(3):
            prior = known * typical[c]
            prior[0, 0] += freed[c]
            expected = scene.values[c] + prior @ np.linalg.solve(prior + measured[c], found[c] - scene.values[c])
            np.testing.assert_allclose(memory.values[c], expected, atol=2e-4 * scene.deviation.mean())


def test_what_cannot_be_factored_is_taken_number_by_number():
    scene = Scene(2)
    covariance = scene.covariance(7, 10)
    scene.show(scene.values, covariance)
    scene.typical.start(scene.absolute)
    broken = covariance.copy()
    broken[1, 3, 5] = broken[1, 5, 3] = 3.0 * np.sqrt(covariance[1, 3, 3] * covariance[1, 5, 5])
    found = scene.values + scene.deviation
    scene.show(found, broken)
    for memory in scene.memories:
        remember(scene, memory, 0.1)
    for _ in range(2):
        for innovation in scene.typical.weigh(scene.absolute):
            np.testing.assert_allclose(innovation[1], found[1] - scene.values[1], rtol=1e-9)
            # equal correlations cancel, in the other channels and in the next frame
            np.testing.assert_allclose(innovation[::2], (found - scene.values)[::2], rtol=1e-3)
    scene.show(found, covariance)
    np.testing.assert_allclose(scene.typical.weigh(scene.absolute)[0], found - scene.values, rtol=1e-3)
