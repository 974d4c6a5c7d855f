"""The fit of a sheet's layers to measured views."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.layers.layer_fit import LayerFit
from arlight.calibration.layers.layer_parameters import EXPECTED, HIGH, LOW, NAMES, STDDEV, vector_of

LAYERS = [NAMES.index(name) for name in NAMES[: NAMES.index("vignetting_k1")]]


@pytest.fixture(scope="module")
def solution(filmed_sheet, measured_views):
    return LayerFit(filmed_sheet.probe, measured_views).solve(EXPECTED)


@pytest.fixture(scope="module")
def deviation(solution, measured_views):
    """Standard deviations if errors repeat from view to view."""
    return np.sqrt(np.diagonal(solution.covariance) * len(measured_views))


def test_the_layers_and_the_light_are_found_together(filmed_sheet, solution, true_light):
    away = (solution.vector - vector_of(filmed_sheet.assembly))[LAYERS] / STDDEV[LAYERS]
    assert np.abs(away).max() < 0.2
    # how bright the light was and how long it was exposed, only their product tells
    shape, true = solution.light / solution.light[0], true_light / true_light[0]
    assert np.sqrt(np.mean((shape - true)[1:] ** 2)) < 0.02
    assert solution.chi2 < 1.0


def test_wherever_it_starts_it_ends_in_the_same_place(filmed_sheet, measured_views, solution, deviation):
    start = np.clip(EXPECTED + 0.4 * STDDEV * np.random.default_rng(1).normal(size=len(NAMES)), LOW, HIGH)
    elsewhere = LayerFit(filmed_sheet.probe, measured_views).solve(start)
    assert np.all(np.abs(elsewhere.vector - solution.vector) < 0.2 * deviation)


def test_a_fit_goes_on_from_its_end_without_moving(filmed_sheet, measured_views, solution, deviation):
    again = LayerFit(filmed_sheet.probe, measured_views).solve(solution.vector)
    assert np.all(np.abs(again.vector - solution.vector) < 0.1 * deviation)


def test_covariances_are_positive_and_never_wider_than_the_prior(solution):
    np.testing.assert_allclose(solution.covariance, solution.covariance.T, atol=1e-10)
    assert np.linalg.eigvalsh(solution.covariance).min() > 0.0
    assert np.all(np.diagonal(solution.covariance) <= STDDEV**2 * (1 + 1e-9))


def test_fewer_views_tell_less(filmed_sheet, measured_views, solution):
    fewer = LayerFit(filmed_sheet.probe, measured_views[::2]).solve(EXPECTED)
    assert np.all(np.diagonal(fewer.covariance)[LAYERS] > np.diagonal(solution.covariance)[LAYERS])


def test_brighter_light_is_all_that_brighter_pictures_are(filmed_sheet, measured_views, solution, deviation):
    def brighter(view):
        means = replace(
            view.means,
            values=1.5 * view.means.values,
            pixel_variance=2.25 * view.means.pixel_variance,
            shading=1.5 * view.means.shading,
        )
        return replace(view, means=means)

    found = LayerFit(filmed_sheet.probe, [brighter(view) for view in measured_views]).solve(EXPECTED)
    assert np.all(np.abs(found.vector - solution.vector) < 1e-3 * deviation)
    np.testing.assert_allclose(found.light, 1.5 * solution.light, rtol=1e-3, atol=1e-3)


def test_views_that_show_nothing_leave_the_expectation(filmed_sheet, measured_views):
    def hidden(view):
        return replace(view, means=replace(view.means, valid=np.zeros_like(view.means.valid)))

    found = LayerFit(filmed_sheet.probe, [hidden(view) for view in measured_views[:2]]).solve(EXPECTED)
    np.testing.assert_allclose(found.vector, EXPECTED, atol=1e-9)
    np.testing.assert_allclose(np.diagonal(found.covariance), STDDEV**2, rtol=1e-6)
    assert found.chi2 == 0.0
