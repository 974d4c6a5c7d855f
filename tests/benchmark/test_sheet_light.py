"""Radiance of one picture's coefficients: certain ones are taken as they are, unknown ones are not believed."""

import numpy as np
import pytest

from arlight.benchmark.sheet_light import SheetLight
from arlight.calibration.ball.mirror_ball import MapGrid
from arlight.environment import Environment
from arlight.estimation.lighting import Lighting
from arlight.fourier import pack_real
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.rendering.reconstruction import reconstruct

GRID = MapGrid(16)


@pytest.fixture(scope="module")
def probe() -> Probe:
    return design_probe(2)


@pytest.fixture(scope="module")
def sheet(probe) -> SheetLight:
    return SheetLight(probe, GRID)


def lighting_of(probe: Probe, coefficients: np.ndarray, stddev: np.ndarray) -> Lighting:
    covariance = np.stack([np.diag(stddev**2)] * 3)
    return Lighting(probe.frequencies, coefficients, covariance, 0.0, 1.0)


@pytest.fixture(scope="module")
def coefficients(probe) -> np.ndarray:
    sky = np.random.default_rng(2).uniform(0.1, 1.0, (32, 64, 3)).astype(np.float32)
    return Environment(sky).coefficients(probe.slab, probe.frequencies)


def test_without_errors_it_is_the_constant_matrix(probe, sheet, coefficients):
    found = sheet.radiance(lighting_of(probe, coefficients, np.zeros(2 * len(coefficients) - 1)))
    rows = reconstruct(probe.slab, probe.frequencies).radiance_rows(GRID.directions().reshape(-1, 3))
    np.testing.assert_allclose(found.reshape(-1, 3), rows @ pack_real(coefficients), rtol=2e-3, atol=1e-4)


def test_what_is_not_known_is_not_believed(probe, sheet, coefficients):
    unknown = np.zeros(2 * len(coefficients) - 1)
    unknown[5] = 1e3
    spoiled = coefficients.copy()
    spoiled[3] += 5.0
    right = sheet.radiance(lighting_of(probe, coefficients, unknown))
    found = sheet.radiance(lighting_of(probe, spoiled, unknown))
    np.testing.assert_allclose(found, right, atol=0.01)
