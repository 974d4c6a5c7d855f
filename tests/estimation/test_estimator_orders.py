"""Fewer orders than the sheet's, and sheets that measure between the whole frequencies."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.errors import ProbeError
from arlight.estimation.estimator import LightingEstimator
from arlight.fourier import analyse, orders_up_to
from arlight.probe.assembly import Assembly
from arlight.tracking.block_layout import field_blocks


@pytest.fixture(scope="module")
def estimator(probe):
    return LightingEstimator(probe)


def room(probe, seed):
    """(k, 3) coefficients of a sky with a few broad lamps: low orders tell roughly what the high ones are."""
    generator = np.random.default_rng(seed)
    points = generator.uniform(-0.5, 0.5, (20_000, 2))
    points = points[np.hypot(*points.T) < 0.5]
    radiance = np.ones(len(points))
    for middle in generator.uniform(-0.3, 0.3, (3, 2)):
        radiance += generator.uniform(1, 4) * np.exp(-np.sum((points - middle) ** 2, axis=1) / 0.02)
    light = analyse(radiance * probe.slab.received_weight(points), points, probe.frequencies)
    return 1.6 * np.repeat((light / light[0])[:, None], 3, axis=1)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_a_lower_order_is_the_same_light_cut_off(probe, estimator, blank, lit, order):
    truth = room(probe, 21)
    means = lit(blank(), truth)
    low = orders_up_to(probe.frequencies, order)
    own = np.array([block.frequency is None or max(np.ceil(np.hypot(*block.frequency)), 0) <= order
                    for block in field_blocks(probe)])  # fmt: skip
    estimate = estimator.estimate(replace(means, valid=own), 0.0, order=order)
    np.testing.assert_array_equal(estimate.lighting.frequencies, probe.frequencies[low])
    assert estimate.lighting.order == order
    assert np.linalg.eigvalsh(estimate.lighting.covariance).min() > 0.0
    assert np.abs(estimate.lighting.coefficients - truth[low]).max() < 0.015 * truth[0].real.max()
    assert np.all(np.abs(estimate.lighting.coefficients - truth[low]) < 2.0 * estimate.lighting.stddev)
    # blocks of higher orders are told nothing of
    assert not estimate.stripes[~own].any()
    assert np.abs(estimate.stripes[own] - means.values[own]).max() < 0.01


def test_orders_may_change_from_frame_to_frame(probe, estimator, blank, lit):
    truth, nuisance = room(probe, 22), None
    for order in (3, 1, 2, None, 0, 3):
        estimate = estimator.estimate(lit(blank(), truth, noise_seed=order), 0.0, nuisance, order)
        nuisance = estimate.nuisance
        kept = len(estimate.lighting.coefficients)
        assert np.abs(estimate.lighting.coefficients - truth[:kept]).max() < 0.02 * truth[0].real.max()


@pytest.mark.parametrize("order", [-1, 4])
def test_an_order_that_the_sheet_does_not_measure_is_refused(estimator, blank, order):
    with pytest.raises(ProbeError, match="order"):
        estimator.estimate(blank(), 0.0, order=order)


def test_a_sheet_of_thicker_glass_tells_whole_frequencies(probe, blank):
    """Stripes keep their period: glass of another thickness measures between the whole frequencies."""
    thicker = Assembly(glass_scale=1.02)
    estimator = LightingEstimator(probe, thicker)
    black = blank()
    estimate = estimator.estimate(black, 0.0)
    np.testing.assert_array_equal(estimate.lighting.frequencies, probe.frequencies)
    # what was not seen between the whole frequencies adds to the doubt
    assert np.linalg.eigvalsh(estimate.lighting.covariance).min() > 0.0
    low = estimator.estimate(black, 0.0, order=1)
    assert np.linalg.eigvalsh(low.lighting.covariance).min() > 0.0
    assert len(low.lighting.coefficients) == 3
