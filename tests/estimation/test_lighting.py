import dataclasses

import numpy as np
import pytest

from arlight.errors import ProbeError
from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies, pack_real, unpack_real


def lighting_of(order, covariance=None):
    frequencies = half_plane_frequencies(order)
    k = len(frequencies)
    if covariance is None:
        covariance = np.zeros((3, 2 * k - 1, 2 * k - 1))
    return Lighting(frequencies, np.ones((k, 3), complex), covariance, 0.5, 1.0)


def random_covariance(size, seed):
    roots = np.random.default_rng(seed).normal(size=(3, size, size))
    return roots @ roots.transpose(0, 2, 1)


@pytest.mark.parametrize("order", [0, 1, 3, 5, 8])
def test_order_is_that_of_its_frequencies(order):
    assert lighting_of(order).order == order


def test_error_bars_are_the_scatter_of_estimates():
    """Draws of correlated real unknowns: rms error of each complex coefficient."""
    covariance = random_covariance(13, 0)
    generator = np.random.default_rng(1)
    errors = [unpack_real(generator.multivariate_normal(np.zeros(13), c, 40_000).T) for c in covariance]
    scatter = np.sqrt(np.mean(np.abs(errors) ** 2, axis=2)).T
    # relative scatter of a standard deviation from 40 000 draws: 0.0035
    np.testing.assert_allclose(lighting_of(2, covariance).stddev, scatter, rtol=0.018)


def test_error_bars_follow_the_order_of_packing():
    lighting = lighting_of(3)
    place = 5
    coefficients = np.zeros((len(lighting.frequencies), 3), complex)
    coefficients[place] = 3 + 4j
    packed = pack_real(coefficients)
    covariance = np.stack([np.outer(packed[:, c], packed[:, c]) for c in range(3)])
    stddev = dataclasses.replace(lighting, covariance=covariance).stddev
    assert stddev[place].tolist() == [5, 5, 5]
    assert np.delete(stddev, place, axis=0).max() == 0


def test_variances_that_rounding_made_negative_are_zero():
    covariance = np.zeros((3, 5, 5))
    covariance[0, 0, 0] = -1e-18
    covariance[1, 1, 1] = -1e-18
    np.testing.assert_array_equal(lighting_of(1, covariance).stddev, 0)


def test_order_0_alone_has_an_error_bar():
    covariance = np.array([1.0, 4.0, 9.0]).reshape(3, 1, 1)
    np.testing.assert_allclose(lighting_of(0, covariance).stddev, [[1, 2, 3]])


@pytest.mark.parametrize("order", [0, 1, 2])
def test_cut_to_an_order_it_keeps_what_is_left(order):
    frequencies = half_plane_frequencies(3)
    k = len(frequencies)
    generator = np.random.default_rng(6)
    packed = generator.normal(size=(2 * k - 1, 3))
    covariance = random_covariance(2 * k - 1, 7)
    whole = Lighting(frequencies, unpack_real(packed), covariance, 0.5, 1.3)
    cut = whole.truncated(order)
    np.testing.assert_array_equal(cut.frequencies, half_plane_frequencies(order))
    left = len(cut.frequencies)
    # frequencies are sorted by |n|, so the lower orders come first
    np.testing.assert_array_equal(pack_real(cut.coefficients), packed[: 2 * left - 1])
    np.testing.assert_array_equal(cut.covariance, covariance[:, : 2 * left - 1, : 2 * left - 1])
    np.testing.assert_array_equal(cut.stddev, whole.stddev[:left])
    assert (cut.order, cut.time_s, cut.chi2) == (order, 0.5, 1.3)


@pytest.mark.parametrize("order", [-1, 4])
def test_an_order_beyond_its_own_is_refused(order):
    with pytest.raises(ProbeError, match=f"order {order} was asked for: the sheet measures orders 0 to 3"):
        lighting_of(3).truncated(order)


def test_another_exposure_scales_light_and_error_bars():
    generator = np.random.default_rng(7)
    frequencies = np.array([[0, 0], [1, 0]])
    factors = generator.normal(size=(3, 3, 3))
    lighting = Lighting(
        frequencies, generator.normal(size=(2, 3)) + 1j, factors @ factors.swapaxes(1, 2) + np.eye(3), 0.0, 1.0
    )
    exposure = np.array([0.5, 1.0, 3.0])
    brighter = lighting.scaled(exposure)
    np.testing.assert_allclose(brighter.coefficients, lighting.coefficients * exposure)
    np.testing.assert_allclose(brighter.stddev, lighting.stddev * exposure)
    np.testing.assert_allclose(brighter.scaled(1 / exposure).covariance, lighting.covariance)
