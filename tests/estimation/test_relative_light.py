"""Light relative to its level: back and forth, blind to exposure, and with the covariance that noise has."""

import numpy as np
import pytest

from arlight.estimation.lighting import Lighting
from arlight.estimation.relative_light import absolute_light, relative_light
from arlight.fourier import half_plane_frequencies, pack_real, unpack_real

FREQUENCIES = half_plane_frequencies(2)
SIZE = 2 * len(FREQUENCIES) - 1


def light(seed=0, level=1.5, sigma=0.01):
    generator = np.random.default_rng(seed)
    packed = level * 0.2 * generator.normal(size=(SIZE, 3))
    packed[0] = level * np.array([1.0, 0.7, 1.3])
    factors = generator.normal(size=(3, SIZE, 2 * SIZE))
    covariance = sigma**2 * factors @ factors.swapaxes(1, 2) / (2 * SIZE)
    return Lighting(FREQUENCIES, unpack_real(packed), covariance, 0.0, 1.0)


@pytest.mark.parametrize("level", [1e-2, 1.5, 40.0])
def test_back_and_forth_changes_nothing(level):
    one = light(level=level)
    coefficients, covariance = absolute_light(*relative_light(one))
    np.testing.assert_allclose(coefficients, one.coefficients, rtol=1e-12)
    np.testing.assert_allclose(covariance, one.covariance, rtol=1e-9, atol=1e-16)


def test_exposure_changes_the_level_alone():
    one, gain = light(), np.array([0.5, 1.0, 3.0])
    bright = Lighting(FREQUENCIES, one.coefficients * gain, one.covariance * (gain**2)[:, None, None], 0.0, 1.0)
    (values, covariance), (other, other_covariance) = relative_light(one), relative_light(bright)
    np.testing.assert_allclose(other[:, 1:], values[:, 1:], rtol=1e-12)
    np.testing.assert_allclose(other[:, 0], gain * values[:, 0], rtol=1e-12)
    np.testing.assert_allclose(other_covariance[:, 1:, 1:], covariance[:, 1:, 1:], rtol=1e-9)


def test_covariance_is_that_of_noise():
    one = light(1, sigma=0.003)
    generator = np.random.default_rng(2)
    factors = np.linalg.cholesky(one.covariance)
    noise = np.einsum("cij,ncj->nic", factors, generator.normal(size=(20000, 3, SIZE)))
    packed = pack_real(one.coefficients) + noise
    relative = packed / packed[:, :1]
    relative[:, 0] = packed[:, 0]
    expected = relative_light(one)[1]
    for channel in range(3):
        found = np.cov(relative[:, :, channel].T)
        scale = np.sqrt(np.outer(np.diagonal(found), np.diagonal(found)))
        # correlations from 20000 samples are known to 0.007, variances to 1 %
        np.testing.assert_allclose(found / scale, expected[channel] / scale, atol=0.04)


def test_darkness_divides_nothing():
    dark = Lighting(FREQUENCIES, np.zeros((len(FREQUENCIES), 3), complex), 1e-6 * light().covariance, 0.0, 1.0)
    values, covariance = relative_light(dark)
    assert np.all(np.isfinite(values))
    assert np.all(np.isfinite(covariance))
    coefficients, _ = absolute_light(values, covariance)
    np.testing.assert_array_equal(coefficients, dark.coefficients)
