"""A view's residual, and its derivatives against differences of it."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.layers.layer_parameters import NAMES, STEP, vector_of
from arlight.calibration.layers.sheet_blocks import SheetBlocks
from arlight.calibration.layers.view_rows import TrialSheet, ViewRows, ViewUnknowns

GREEN = 1
LAYERS = NAMES[: NAMES.index("vignetting_k1")]


@pytest.fixture(scope="module")
def blocks(filmed_sheet):
    return SheetBlocks.of(filmed_sheet.probe)


@pytest.fixture(scope="module")
def vector(filmed_sheet):
    vector = vector_of(filmed_sheet.assembly)
    for name, value in {"vignetting_k1": -0.05, "vignetting_k2": 0.01, "gradient_x": 0.01, "lower_face": 0.8}.items():
        vector[NAMES.index(name)] = value
    return vector


@pytest.fixture(scope="module")
def unknowns(blocks):
    field = 0.01 * np.random.default_rng(1).normal(size=blocks.basis.shape[1])
    field[0] = 0.03
    return ViewUnknowns(field, 0.5, 0.1)


@pytest.fixture(scope="module")
def predict(filmed_sheet, measured_views, blocks):
    def rows(vector, light, unknowns):
        trial = TrialSheet(filmed_sheet.probe, vector, light)
        return ViewRows.of(measured_views[0], blocks, trial, vector, unknowns)

    return rows


@pytest.fixture(scope="module")
def rows(predict, vector, true_light, unknowns):
    return predict(vector, true_light, unknowns)


def off(found, expected):
    """How far slopes of rows stray, relative to their size."""
    return np.sqrt(np.mean((found - expected) ** 2)) / np.sqrt(np.mean(expected**2))


@pytest.mark.parametrize("name", LAYERS)
def test_lit_rows_change_with_the_layers_as_is_said(name, predict, vector, true_light, unknowns):
    bare = replace(unknowns, reflection=0.0 * unknowns.reflection)
    column = NAMES.index(name)
    step = np.where(np.arange(len(NAMES)) == column, STEP, 0.0)
    ahead, behind = (predict(vector + sign * step, true_light, bare).residual for sign in (1, -1))
    found = predict(vector, true_light, bare).shared[:, :, column]
    # one-sided, and without what the layers change in the glass's echoes; these are a twentieth of the light
    assert off(found, (behind - ahead) / (2 * step[column])) < (0.12 if name == "glass_scale" else 0.04)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in LAYERS])
def test_rows_change_with_gains_and_the_lower_face_as_is_said(name, rows, predict, vector, true_light, unknowns):
    column = NAMES.index(name)
    step = np.where(np.arange(len(NAMES)) == column, STEP, 0.0)
    ahead, behind = (predict(vector + sign * step, true_light, unknowns).residual for sign in (1, -1))
    assert off(rows.shared[:, :, column], (behind - ahead) / (2 * step[column])) < 1e-9


@pytest.mark.parametrize("place", [0, 1, 4, 9])
def test_rows_change_with_the_light_as_is_said(place, rows, predict, vector, true_light, unknowns):
    step = np.zeros(len(true_light))
    step[place] = 1e-3
    slopes = (rows.residual - predict(vector, true_light + step, unknowns).residual) / 1e-3
    found = rows.shared[:, :, len(NAMES) + place]
    # what the light's shape changes in the echoes is left out: little, and in all blocks
    seen = np.any(found, axis=1)
    assert off(found[seen], slopes[seen]) < 0.06
    assert np.abs(slopes[~seen]).max(initial=0.0) < 0.03 * np.abs(rows.shared[:, :, len(NAMES)]).max()


def test_rows_change_with_the_views_own_unknowns_as_is_said(rows, predict, vector, true_light, unknowns):
    size = rows.own.shape[2]
    bare = replace(unknowns, reflection=0.0 * unknowns.reflection)
    for place in (0, 1, size - 3, size - 2, size - 1):
        # blur attenuates what the lower face mirrors as well, which is left out
        own = bare if place == size - 2 else unknowns
        before = predict(vector, true_light, own)
        step = np.zeros(size)
        step[place] = 1e-5
        ahead = predict(vector, true_light, own.moved(step)).residual
        assert off(before.own[:, :, place], (before.residual - ahead) / 1e-5) < 1e-4


def test_without_light_only_the_mirrored_field_is_left(predict, vector, true_light, unknowns, measured_views, blocks):
    dark = predict(vector, np.zeros_like(true_light), unknowns)
    shown = measured_views[0].means.values[:, :, GREEN] - dark.residual
    np.testing.assert_allclose(shown, dark.mirror * (blocks.basis @ unknowns.reflection)[:, None], atol=1e-15)
    assert not dark.shared[:, :, : NAMES.index("vignetting_k1")].any()


def test_a_longer_exposure_brightens_the_sheet_and_not_its_mirror_image(predict, vector, true_light, unknowns):
    longer = unknowns.moved(np.append(np.zeros(len(unknowns.reflection) + 1), np.log(2.0)))
    dark, once, twice = (
        predict(vector, light, own).residual
        for light, own in ((0.0 * true_light, unknowns), (true_light, unknowns), (true_light, longer))
    )
    np.testing.assert_allclose(twice - dark, 2.0 * (once - dark), atol=1e-12)


def test_blur_stays_within_what_pictures_can_be():
    own = ViewUnknowns(np.zeros(2), 0.5)
    assert own.moved(np.array([0.0, 0.0, -9.0, 0.0])).blur_px2 == 0.0
    assert own.moved(np.array([0.0, 0.0, 99.0, 0.0])).blur_px2 == 6.0
