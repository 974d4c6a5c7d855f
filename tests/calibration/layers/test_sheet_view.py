"""Views of a sheet: what an assembled sheet is predicted to show, against what the renderer's pictures show."""

import numpy as np
import pytest

from arlight.calibration.layers.sheet_view import PredictedSheet
from arlight.calibration.layers.view_measurement import ViewMeter
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.probe.assembly import Assembly
from arlight.tracking.block_layout import field_blocks

GREEN = 1


@pytest.fixture(scope="module")
def mirrored(filmed_sheet, measured_views):
    """Radiance that each view's film mirrors, as its black regions have it."""
    black = np.array([block.kind == "black_black" for block in field_blocks(filmed_sheet.probe)])
    return [float(np.median(view.means.values[black, 0, GREEN])) for view in measured_views]


@pytest.fixture(scope="module")
def sheet(filmed_sheet):
    return PredictedSheet(filmed_sheet.probe, filmed_sheet.assembly)


def harmonics(sheet, view, light, mirrored):
    """Harmonics that a sheet predicts under given light, and those that were measured."""
    rows = np.einsum("brk,bk->br", sheet.light(view, light / light[0]), light[sheet.response.places])
    rows += mirrored * sheet.lower_mirror(view)
    rows *= optical_transfer(view.means.cycles_per_px, view.blur_px**2)
    seen = (view.means.harmonics[:, None] >= np.repeat((1, 2, 3), 2)) & view.means.valid[:, None]
    return rows[:, 1:][seen], view.means.values[:, 1:, GREEN][seen]


def test_the_true_sheet_under_the_true_light_shows_what_was_measured(sheet, measured_views, true_light, mirrored):
    for view, glare in zip(measured_views, mirrored, strict=True):
        predicted, measured = harmonics(sheet, view, true_light, glare)
        assert np.sqrt(np.mean((measured - predicted) ** 2)) < 0.06 * np.sqrt(np.mean(measured**2))


def test_the_sheet_as_designed_does_not(filmed_sheet, measured_views, true_light, mirrored):
    designed = PredictedSheet(filmed_sheet.probe, Assembly())
    predicted, measured = harmonics(designed, measured_views[0], true_light, mirrored[0])
    assert np.sqrt(np.mean((measured - predicted) ** 2)) > 0.3 * np.sqrt(np.mean(measured**2))


def test_predictions_follow_the_phase_that_a_view_was_measured_in(filmed_sheet, sheet, true_light, mirrored):
    # film and glass were taken for the design's, and lie elsewhere
    careless = ViewMeter(filmed_sheet.probe, filmed_sheet.camera, Assembly()).measure(filmed_sheet.seen[0])
    predicted, measured = harmonics(sheet, careless, true_light, mirrored[0])
    assert np.sqrt(np.mean((measured - predicted) ** 2)) < 0.06 * np.sqrt(np.mean(measured**2))


def test_measured_as_it_is_a_sheet_shows_its_bare_response(filmed_sheet, sheet, measured_views):
    view, response = measured_views[0], BlockResponse(filmed_sheet.probe, filmed_sheet.assembly)
    np.testing.assert_allclose(sheet.light(view), response.light(view.means), atol=1e-12)
    np.testing.assert_allclose(sheet.lower_mirror(view), response.lower_mirror(view.means), atol=1e-12)


def test_some_blocks_alone_are_the_same_blocks(measured_views):
    view = measured_views[0]
    chosen = np.arange(len(view.means.valid)) % 3 == 0
    part = view.of_blocks(chosen)
    assert part.light == view.light
    assert part.blur_px == view.blur_px
    np.testing.assert_array_equal(part.means.values, view.means.values[chosen])
    np.testing.assert_array_equal(part.radius_squared, view.radius_squared[chosen])
    np.testing.assert_array_equal(part.offset_per_mm, view.offset_per_mm[chosen])


def test_blocks_lie_in_the_picture_where_the_camera_sees_them(filmed_sheet, measured_views):
    # the picture's corner is one half diagonal off its middle
    for view in measured_views:
        assert np.all((view.radius_squared >= 0.0) & (view.radius_squared < 1.1))
    # D leans toward the camera, by no more than light can inside the glass
    index = filmed_sheet.probe.refractive_index
    for view, seen in zip(measured_views, filmed_sheet.seen, strict=True):
        assert np.all(view.offset_per_mm @ seen.offset_mm[:2] > 0.0)
        assert np.all(np.linalg.norm(view.offset_per_mm, axis=1) < 1.0 / np.sqrt(index**2 - 1.0))
