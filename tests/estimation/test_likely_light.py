"""What measurements are taken for beside what is known: laws of conditional Gaussian expectation."""

import numpy as np
import pytest

from arlight.estimation.likely_light import LikelyLight

SIZE = 9


def covariance(seed: int, scale: float = 1.0) -> np.ndarray:
    factors = np.random.default_rng(seed).standard_normal((SIZE, 3 * SIZE))
    return scale * factors @ factors.T / (3 * SIZE)


@pytest.fixture
def prior() -> np.ndarray:
    """Covariance of coefficients whose level has something to do with the others."""
    return covariance(1) + 0.3


@pytest.mark.parametrize("scale", [1e-3, 0.1, 10.0])
def test_the_likeliest_light_is_the_conditional_mean_once_the_level_is_known(prior: np.ndarray, scale: float) -> None:
    errors = covariance(2, scale)
    # in the joint distribution of all coefficients the level is measured a million times better
    certain = errors * np.outer([1e-6] + [1.0] * (SIZE - 1), [1e-6] + [1.0] * (SIZE - 1))
    relative = prior / prior[0, 0]
    expected = relative @ np.linalg.inv(relative + certain)
    np.testing.assert_allclose(LikelyLight.of_covariance(prior).weights(errors), expected, atol=1e-4)


def test_the_level_is_kept_and_what_is_expected_is_never_changed(prior: np.ndarray) -> None:
    light = LikelyLight.of_covariance(prior)
    for scale in (1e-6, 1.0, 1e6):
        weights = light.weights(covariance(3, scale))
        np.testing.assert_array_equal(weights[0], np.eye(SIZE)[0])
        np.testing.assert_allclose(weights @ light.expected, light.expected, atol=1e-9)


def test_what_is_certain_stays_and_what_is_unknown_is_what_is_expected(prior: np.ndarray) -> None:
    light, measured = LikelyLight.of_covariance(prior), np.random.default_rng(4).standard_normal((SIZE, 3))
    np.testing.assert_allclose(light.weights(covariance(5, 1e-9)) @ measured, measured, atol=1e-6)
    unknown = light.weights(covariance(5, 1e9)) @ measured
    np.testing.assert_allclose(unknown, np.outer(light.expected, measured[0]), atol=1e-6)


def test_precisions_add_up(prior: np.ndarray) -> None:
    light, errors = LikelyLight.of_covariance(prior), covariance(6, 0.3)
    posterior = light.posterior(errors)
    assert not np.any(posterior[0])
    assert not np.any(posterior[:, 0])
    precision = np.linalg.inv(light.covariance[1:, 1:]) + np.linalg.inv(errors[1:, 1:])
    np.testing.assert_allclose(np.linalg.inv(posterior[1:, 1:]), precision, rtol=1e-6)


def test_the_first_coefficients_are_weighed_by_what_is_known_of_them(prior: np.ndarray) -> None:
    errors = covariance(7, 0.1)[:5, :5]
    whole, cut = LikelyLight.of_covariance(prior), LikelyLight.of_covariance(prior[:5, :5])
    np.testing.assert_allclose(whole.weights(errors), cut.weights(errors), atol=1e-12)
    np.testing.assert_allclose(whole.posterior(errors), cut.posterior(errors), atol=1e-12)
