"""One call from measurements to light: what its parts do one after the other."""

import numpy as np
import pytest

from arlight.estimation.channel_fit import GREEN, SheetFit
from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.measured_blocks import MeasuredBlocks
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.reflection import reflection_basis
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL
from arlight.fourier import unpack_real
from arlight.tracking.block_layout import field_blocks


@pytest.fixture(scope="module")
def parts(probe, response):
    """Planes and fit of the sheet as the estimator has them."""
    blocks = field_blocks(probe)
    kinds = [block.kind for block in blocks]
    measured = MeasuredBlocks(kinds, response.sequence, probe.slab.refractive_index, response.phasor, response.cosine)
    basis = reflection_basis(np.array([block.center_mm for block in blocks], float))
    model = np.where(np.array(kinds) == "clear_white", WHITE_MODEL, MEAN_MODEL)
    white = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
    return measured, SheetFit(measured, response, probe.frequencies, basis, model, white)


def by_parts(parts, response, means, nuisance, count):
    """Mean chi-square of a frame's channels; the rest is left in the fit."""
    measured, fit = parts
    used = fit.begin(count)
    measured.gather(means, used)
    fit.recall(nuisance)
    response.fill(used, nuisance.shape)
    if nuisance.shape is not None:
        green = fit.fit(GREEN, 2)
    else:
        fit.fit(GREEN, 4, settle=True)
        response.fill(used, np.clip(fit.packed[GREEN] / fit.packed[GREEN, 0], -1.0, 1.0))
        green = fit.fit(GREEN, 4, settle=True)
    return np.mean([green.chi2, fit.fit(0).chi2, fit.fit(2).chi2])


@pytest.mark.parametrize("order", [1, 3])
def test_a_sheet_is_its_channels_one_after_the_other(probe, parts, response, blank, lit, random_light, order):
    means = lit(blank(sigma=0.003), random_light(5), mirrored=0.02, noise_seed=5)
    estimator, nuisance = LightingEstimator(probe), Nuisance.guess(0.3)
    fit, count = parts[1], int(np.sum(np.hypot(*probe.frequencies.T) <= order))
    for _ in range(3):
        estimate = estimator.estimate(means, 0.0, nuisance, order)
        assert estimate.lighting.chi2 == pytest.approx(by_parts(parts, response, means, nuisance, count))
        level = estimate.lighting.coefficients[0].real.max()
        expected = unpack_real(fit.packed.T)
        np.testing.assert_allclose(estimate.lighting.coefficients, expected, atol=1e-9 * level)
        np.testing.assert_allclose(estimate.lighting.covariance, fit.covariance, rtol=1e-6, atol=1e-12 * level**2)
        nuisance = estimate.nuisance
        np.testing.assert_allclose(nuisance.numbers[:5], fit.nuisances[GREEN], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(nuisance.shape, fit.packed[GREEN] / fit.packed[GREEN, 0], atol=1e-9)
        lamps = fit.lamps[GREEN] / parts[0].white[GREEN] ** 2
        np.testing.assert_allclose(nuisance.blocks, [lamps, fit.weights[GREEN]], rtol=1e-6)


def test_a_frame_of_nonsense_is_not_handed_on(probe, blank, lit, random_light):
    means, estimator = lit(blank(), random_light(1)), LightingEstimator(probe)
    known = estimator.estimate(means, 0.0).nuisance
    means.values[:] = np.nan
    assert estimator.estimate(means, 0.0, known).nuisance.shape is None
