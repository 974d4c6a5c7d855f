"""What rows of a view count for: noise, lamps, hidden blocks, rows that were not measured."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.layers.layer_parameters import vector_of
from arlight.calibration.layers.sheet_blocks import SheetBlocks
from arlight.calibration.layers.view_rows import GREEN, TrialSheet, ViewRows, ViewUnknowns
from arlight.calibration.layers.view_weights import ViewWeights
from arlight.estimation.stripe_rows import usable_rows


@pytest.fixture(scope="module")
def blocks(filmed_sheet):
    return SheetBlocks.of(filmed_sheet.probe)


@pytest.fixture(scope="module")
def rows(filmed_sheet, measured_views, blocks, true_light):
    """What the true sheet under the true light leaves over, the field taken for its usual value."""
    view, vector = measured_views[0], vector_of(filmed_sheet.assembly)
    field = np.zeros(blocks.basis.shape[1])
    field[0] = np.median(view.means.values[blocks.black & view.means.valid, 0, GREEN])
    trial = TrialSheet(filmed_sheet.probe, vector, true_light)
    return ViewRows.of(view, blocks, trial, vector, ViewUnknowns(field, view.blur_px**2))


@pytest.fixture(scope="module")
def weigh(measured_views, blocks, rows):
    """Weights with changed residuals, after as many iterations."""
    level = float(np.median(measured_views[0].means.values[blocks.white, 0, GREEN]))

    def weights(residual=None, view=measured_views[0], iterations=4, scale=1.0):
        changed = rows if residual is None else replace(rows, residual=residual)
        found = ViewWeights.of(view, blocks, changed, scale * level, None)
        for _ in range(iterations - 1):
            found = ViewWeights.of(view, blocks, changed, scale * level, found.lamp)
        return found

    return weights


def own_weight(weights, block):
    """How much the harmonics of a block count together."""
    return np.trace(weights.precision[block, 1:, 1:])


def test_the_true_sheet_leaves_over_no_more_than_is_expected(weigh):
    assert 0.0 < weigh().chi2 < 1.0


def test_precisions_are_symmetric_and_never_negative(weigh):
    precision = weigh().precision
    np.testing.assert_allclose(precision, precision.swapaxes(1, 2), rtol=1e-9, atol=1e-6)
    assert np.linalg.eigvalsh(precision).min() > -1e-9 * precision.max()


def test_rows_that_were_not_measured_do_not_count(weigh, measured_views, rows):
    view = measured_views[0]
    unseen = np.arange(len(view.means.valid)) % 5 == 0
    less = replace(view, means=replace(view.means, valid=view.means.valid & ~unseen))
    spoilt = rows.residual.copy()
    spoilt[unseen] = 1e3
    found = weigh(spoilt, less)
    usable = usable_rows(less.means, rows.transfer)
    assert not found.precision[~usable].any()
    assert not np.swapaxes(found.precision, 1, 2)[~usable].any()
    assert found.chi2 < 1.0


def test_a_mirrored_lamp_costs_a_block_its_mean_and_not_its_harmonics(weigh, rows, blocks):
    patterned = int(np.flatnonzero(~blocks.white & ~blocks.black)[7])
    struck = rows.residual.copy()
    struck[patterned] += 0.2 * rows.mirror[patterned]
    before, after = weigh(), weigh(struck)
    assert after.lamp[patterned] > 100.0 * before.lamp[patterned]
    assert after.precision[patterned, 0, 0] < 0.5 * before.precision[patterned, 0, 0]
    assert own_weight(after, patterned) > 0.5 * own_weight(before, patterned)
    others = np.arange(len(rows.residual)) != patterned
    np.testing.assert_array_equal(after.precision[others], before.precision[others])


def test_a_hidden_block_loses_its_weight_and_no_other_does(weigh, rows, blocks):
    patterned = int(np.flatnonzero(~blocks.white & ~blocks.black)[3])
    hidden = rows.residual.copy()
    hidden[patterned, 1:] += np.array([0.05, -0.04, 0.02, 0.03, -0.02, 0.01])
    before, after = weigh(), weigh(hidden)
    assert own_weight(after, patterned) < 0.1 * own_weight(before, patterned)
    others = np.arange(len(rows.residual)) != patterned
    np.testing.assert_array_equal(after.precision[others], before.precision[others])


def test_uneven_blocks_are_granted_a_brighter_lamp(weigh, measured_views):
    view = measured_views[0]
    uneven = replace(view, means=replace(view.means, shading=view.means.shading + 0.05))
    assert np.all(weigh(view=uneven).lamp > weigh().lamp)
