"""Light relative to its level: back and forth, blind to exposure, and with the covariance that noise has."""

import numpy as np
import pytest

from arlight.estimation.lighting import Lighting
from arlight.estimation.relative_light import RelativeLight
from arlight.estimation.typical_error import TypicalError
from arlight.fourier import half_plane_frequencies, pack_real, unpack_real

FREQUENCIES = half_plane_frequencies(2)
SIZE = 2 * len(FREQUENCIES) - 1
ONES = np.ones(3)


def light(seed=0, level=1.5, sigma=0.01):
    generator = np.random.default_rng(seed)
    packed = level * 0.2 * generator.normal(size=(SIZE, 3))
    packed[0] = level * np.array([1.0, 0.7, 1.3])
    factors = generator.normal(size=(3, SIZE, 2 * SIZE))
    covariance = sigma**2 * factors @ factors.swapaxes(1, 2) / (2 * SIZE)
    return Lighting(FREQUENCIES, unpack_real(packed), covariance, 0.0, 1.0)


def relative(lighting, exposure=ONES):
    """The relative light and its covariance (3, n, n)."""
    taken = RelativeLight(3, SIZE)
    taken.take(lighting.coefficients, lighting.covariance, exposure)
    typical = TypicalError(1.0, taken, ())
    typical.start(lighting.covariance)
    np.testing.assert_allclose(taken.variance, np.einsum("cii->ci", typical.covariance), rtol=1e-9)
    return taken, typical.covariance


@pytest.mark.parametrize("level", [1e-2, 1.5, 40.0])
@pytest.mark.parametrize("exposure", [ONES, np.array([0.5, 1.0, 3.0])])
def test_back_and_forth_changes_nothing(level, exposure):
    one = light(level=level)
    taken, shape = relative(one, exposure)
    coefficients, covariance = taken.give(exposure, shape)
    np.testing.assert_allclose(coefficients, one.coefficients, rtol=1e-12)
    np.testing.assert_allclose(covariance, one.covariance, rtol=1e-9, atol=1e-16)


def test_exposure_changes_the_level_alone():
    one, gain = light(), np.array([0.5, 1.0, 3.0])
    bright = one.scaled(gain)
    (taken, covariance), (other, other_covariance) = relative(one), relative(bright)
    np.testing.assert_allclose(other.values[:, 1:], taken.values[:, 1:], rtol=1e-12)
    np.testing.assert_allclose(other.values[:, 0], gain * taken.values[:, 0], rtol=1e-12)
    np.testing.assert_allclose(other_covariance[:, 1:, 1:], covariance[:, 1:, 1:], rtol=1e-9)


def test_an_exposure_that_is_known_changes_nothing():
    one, gain = light(), np.array([0.5, 1.0, 3.0])
    (taken, covariance), (other, other_covariance) = relative(one), relative(one.scaled(gain), gain)
    np.testing.assert_allclose(other.values, taken.values, rtol=1e-12)
    np.testing.assert_allclose(other_covariance, covariance, rtol=1e-9)
    coefficients, told = other.give(gain, other_covariance)
    np.testing.assert_allclose(coefficients, one.coefficients * gain, rtol=1e-12)
    np.testing.assert_allclose(told, one.scaled(gain).covariance, rtol=1e-9, atol=1e-16)


def test_covariance_is_that_of_noise():
    one = light(1, sigma=0.003)
    generator = np.random.default_rng(2)
    factors = np.linalg.cholesky(one.covariance)
    noise = np.einsum("cij,ncj->nic", factors, generator.normal(size=(20000, 3, SIZE)))
    packed = pack_real(one.coefficients) + noise
    strayed = packed / packed[:, :1]
    strayed[:, 0] = packed[:, 0]
    expected = relative(one)[1]
    for channel in range(3):
        found = np.cov(strayed[:, :, channel].T)
        scale = np.sqrt(np.outer(np.diagonal(found), np.diagonal(found)))
        # correlations from 20000 samples are known to 0.007, variances to 1 %
        np.testing.assert_allclose(found / scale, expected[channel] / scale, atol=0.04)


def test_correlations_may_be_those_of_another_light():
    (taken, own), (_, other) = relative(light(3)), relative(light(4, sigma=0.2))
    _, covariance = taken.give(ONES, other)
    # relative again, with the slopes of this light written out
    packed = pack_real(light(3).coefficients)
    for c in range(3):
        slope = np.eye(SIZE) / packed[0, c]
        slope[1:, 0], slope[0, 0] = -packed[1:, c] / packed[0, c] ** 2, 1.0
        back = slope @ covariance[c] @ slope.T
        np.testing.assert_allclose(np.diagonal(back), np.diagonal(own[c]), rtol=1e-9)
        deviations = [np.sqrt(np.diagonal(m)) for m in (back, other[c])]
        correlations = [m / np.outer(d, d) for m, d in zip((back, other[c]), deviations, strict=True)]
        np.testing.assert_allclose(*correlations, atol=1e-9)


def test_darkness_divides_nothing():
    dark = Lighting(FREQUENCIES, np.zeros((len(FREQUENCIES), 3), complex), 1e-6 * light().covariance, 0.0, 1.0)
    taken, covariance = relative(dark)
    assert np.all(np.isfinite(taken.values))
    assert np.all(np.isfinite(covariance))
    coefficients, _ = taken.give(ONES, covariance)
    np.testing.assert_array_equal(coefficients, dark.coefficients)


def test_memory_laid_out_in_another_way_is_refused():
    one = light(5)
    with pytest.raises(TypeError, match="contiguous"):
        RelativeLight(3, SIZE).take(np.asfortranarray(one.coefficients), one.covariance, ONES)
