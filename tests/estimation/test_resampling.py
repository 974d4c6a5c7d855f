"""Whole frequencies from those that thicker or turned glass measures, against the light's own transform."""

import numpy as np
import pytest

from arlight.estimation.resampling import measured_frequencies, resampling
from arlight.fourier import analyse, frequency_order, pack_real
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.layout import design_probe

PROBE = design_probe(order=5)
THICKER = Assembly(glass_scale=1.02)
TURNED = Assembly(film=Print(Registration(rotation_deg=0.3)))


def lamps(seed):
    """Received light of a sky and a few broad lamps: points of the light plane with their light."""
    generator = np.random.default_rng(seed)
    points = generator.uniform(-0.5, 0.5, (40_000, 2))
    points = points[np.hypot(*points.T) < 0.5]
    light = 1.0 + 0.3 * points[:, 0]
    for _ in range(3):
        middle = generator.uniform(-0.3, 0.3, 2)
        light = light + generator.uniform(1, 6) * np.exp(-np.sum((points - middle) ** 2, axis=1) / 0.01)
    return points, light / light.sum()


def test_a_sheet_as_designed_measures_whole_frequencies():
    np.testing.assert_allclose(measured_frequencies(PROBE, Assembly()), PROBE.frequencies, atol=1e-12)
    assert resampling(PROBE, Assembly()) is None


def test_thicker_glass_measures_proportionally_higher_frequencies():
    np.testing.assert_allclose(measured_frequencies(PROBE, THICKER), 1.02 * PROBE.frequencies, atol=1e-12)


@pytest.mark.parametrize("assembly", [THICKER, TURNED])
@pytest.mark.parametrize("seed", range(3))
def test_prediction_brings_the_whole_frequencies_back(assembly, seed):
    points, light = lamps(seed)
    seen = pack_real(analyse(light, points, measured_frequencies(PROBE, assembly)))
    true = pack_real(analyse(light, points, PROBE.frequencies))
    small = 1e-6 * np.eye(len(seen))
    predicted, covariance = resampling(PROBE, assembly).apply(seen, small)
    order = np.repeat(frequency_order(PROBE.frequencies), 2)[1:]
    rms = [np.sqrt(np.mean((predicted - true)[order == k] ** 2)) for k in range(1, 6)]
    before = [np.sqrt(np.mean((seen - true)[order == k] ** 2)) for k in range(1, 6)]
    # a tenth of a per cent of L_0 is what the prediction allows for noise
    assert all(after < max(first / 3, 1e-3) for after, first in zip(rms[:4], before[:4], strict=True))
    # beyond the highest order nothing was measured: there the prediction is least sure, and says so
    assert rms[4] < before[4]
    normalised = (predicted - true) ** 2 / np.diag(covariance)
    assert np.mean(normalised) < 3.0
    assert np.all(np.linalg.eigvalsh(covariance) > 0)
