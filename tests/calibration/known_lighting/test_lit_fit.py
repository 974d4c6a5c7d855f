"""Laws of the fit that need no convergence."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.known_lighting.block_corrections import MODEL, CorrectionPrior
from arlight.calibration.known_lighting.lit_fit import KnownLightingFit
from arlight.calibration.known_lighting.lit_views import measure
from arlight.calibration.known_lighting.lit_weights import RowModel
from arlight.calibration.known_lighting.sheet_model import (
    EXPECTED,
    LAYER_STDDEV,
    Linearisation,
    SheetModel,
    Unknowns,
    turned_rows,
)
from arlight.fourier import frequency_order
from arlight.tracking.block_layout import field_blocks


@pytest.fixture(scope="module")
def setting(lit_sheet):
    """Views, a fit, and a trial a little off the model."""
    blocks = field_blocks(lit_sheet.probe)
    white = np.array([block.kind == "clear_white" for block in blocks])
    order = frequency_order(np.array([block.frequency or (0, 0) for block in blocks]))
    generator = np.random.default_rng(8)
    layers = np.maximum(EXPECTED + 0.05 * LAYER_STDDEV * generator.normal(size=len(EXPECTED)), 0.0)
    corrections = MODEL + generator.normal(size=(len(blocks), 4)) * 0.2 * CorrectionPrior().stddev
    frames = lit_sheet.seen[:3]
    own = np.tile([0.3, 0.0, 0.0, 0.0, 0.0], (len(frames), 1))
    trial = Unknowns(layers, corrections, own, np.ones((len(lit_sheet.lights), 3)))
    views = measure(frames, lit_sheet.lights, lit_sheet.probe, lit_sheet.camera, trial.assembly)
    fit = KnownLightingFit(lit_sheet.probe, lit_sheet.lights, RowModel(white, order), CorrectionPrior(), False)
    return fit, views, trial


def test_without_measurements_a_step_leads_to_the_model(setting):
    fit, views, trial = setting
    blind = [
        replace(
            view,
            sheet=replace(view.sheet, means=replace(view.sheet.means, valid=np.zeros_like(view.sheet.means.valid))),
        )
        for view in views
    ]
    stepped, _ = fit.step(trial, blind, 2, 0.0)
    np.testing.assert_allclose(stepped.layers, EXPECTED, atol=1e-9)
    np.testing.assert_allclose(stepped.blocks, np.tile(MODEL, (len(trial.blocks), 1)), atol=1e-9)


def test_leaving_a_lighting_out_is_a_fit_without_its_views(setting):
    fit, views, trial = setting
    normal = fit.normal(trial, views)
    first = views[0].sheet.light
    others = [number for number, view in enumerate(views) if view.sheet.light != first]
    alone = replace(trial, views=trial.views[others])
    expected, _ = fit.normal(alone, [views[number] for number in others]).solve()
    found, _ = normal.solve(without=first)
    shared, blocks = len(EXPECTED), trial.blocks.size
    np.testing.assert_allclose(found[:shared], expected[:shared], atol=1e-6)
    np.testing.assert_allclose(found[-blocks:], expected[-blocks:], atol=1e-6)


def test_the_order_of_views_does_not_matter(setting):
    fit, views, trial = setting
    order = [2, 0, 1]
    turned = replace(trial, views=trial.views[order])
    steps = [fit.step(trial, views, 2, 0.0)[0], fit.step(turned, [views[number] for number in order], 2, 0.0)[0]]
    np.testing.assert_allclose(steps[0].layers, steps[1].layers, atol=1e-9)
    np.testing.assert_allclose(steps[0].blocks, steps[1].blocks, atol=1e-9)
    np.testing.assert_allclose(steps[0].views[order], steps[1].views, atol=1e-9)


def test_predictions_are_linear_in_exposure(lit_sheet, setting):
    _, views, trial = setting
    model = SheetModel(lit_sheet.probe, lit_sheet.lights, trial)
    once, twice = (model.predict(views[0], trial.views[0], factor * np.ones(3)).rows for factor in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2.0 * once, rtol=1e-12)


def test_differences_foretell_small_changes(lit_sheet, setting):
    _, views, trial = setting
    linear = Linearisation(lit_sheet.probe, lit_sheet.lights, trial)
    shared, single = linear.differences(views[0], 0)
    generator = np.random.default_rng(9)
    change = 0.02 * LAYER_STDDEV * generator.normal(size=len(EXPECTED))
    change = np.where(EXPECTED + change < 0.0, -change, change)
    own = np.array([0.01, 1e-3, -1e-3, 1e-4, 1e-4])
    blocks = generator.normal(size=trial.blocks.shape) * 0.05 * CorrectionPrior().stddev
    moved = Unknowns(trial.layers + change, trial.blocks + blocks, trial.views, trial.exposures)
    actual = (
        SheetModel(lit_sheet.probe, lit_sheet.lights, moved).predict(views[0], trial.views[0] + own, np.ones(3)).rows
    )
    base = linear.predict(views[0], 0).rows
    foretold = shared @ np.concatenate([change, own]) + np.einsum("brck,bk->brc", single, blocks)
    size = np.sqrt(np.mean((actual - base) ** 2))
    assert np.sqrt(np.mean((actual - base - foretold) ** 2)) < 0.05 * size


def test_turned_rows_are_the_rows_of_moved_stripes():
    phase = 2 * np.pi * np.arange(64) / 64
    waves = np.stack([np.ones(64), *(wave(m * phase) for m in (1, 2, 3) for wave in (np.cos, np.sin))])
    generator = np.random.default_rng(3)
    rows, turn = generator.normal(size=(5, 7)), generator.uniform(-3, 3, 5)
    moved = turned_rows(rows[..., None], turn)[..., 0]
    for row, other, angle in zip(rows, moved, turn, strict=True):
        ahead = np.stack([np.ones(64), *(wave(m * (phase + angle)) for m in (1, 2, 3) for wave in (np.cos, np.sin))])
        np.testing.assert_allclose(other @ waves, row @ ahead, atol=1e-12)
