"""The frame keeps to whole pixels and to the point symmetry that lets the wedge's two halves cancel a falling light."""

import numpy as np
import pytest

from arlight.probe.frame_layout import frame_around, place_markers, place_wedge

FIELDS = [(20.0, 20.0), (37.1, 61.8), (148.4, 185.5), (400.0, 310.0)]


@pytest.mark.parametrize("field_mm", FIELDS)
@pytest.mark.parametrize("pixels_per_mm", [8.0, 11.811, 20.0])
def test_everything_printed_is_in_whole_pixels(field_mm, pixels_per_mm):
    frame = frame_around(field_mm, pixels_per_mm)
    corners = np.array([marker.corners_mm for marker in place_markers(frame)])
    steps = np.array([[(c - s.size_mm / 2.0, c + s.size_mm / 2.0) for c in s.center_mm] for s in place_wedge(frame, 0)])
    for places in (corners * pixels_per_mm, steps * pixels_per_mm):
        np.testing.assert_allclose(places, np.round(places), atol=1e-6)


@pytest.mark.parametrize("field_mm", FIELDS)
def test_markers_are_point_symmetric(field_mm):
    corners = np.array([marker.corners_mm for marker in place_markers(frame_around(field_mm, 20.0))])
    centres = corners.mean(axis=1)
    distance = np.linalg.norm(centres[:, None] + centres[None], axis=-1)
    np.testing.assert_allclose(distance.min(axis=1), 0.0, atol=1e-9)


@pytest.mark.parametrize("field_mm", FIELDS[1:])
def test_light_that_falls_off_across_the_sheet_cancels(field_mm):
    steps = place_wedge(frame_around(field_mm, 20.0), 0)
    by_value: dict[float, list[tuple[float, float]]] = {}
    for step in steps:
        by_value.setdefault(step.reflectance, []).append(step.center_mm)
    paired = len(steps) > len(by_value)
    for places in by_value.values():
        assert len(places) == (2 if paired else 1)
        if paired:
            np.testing.assert_allclose(np.sum(places, axis=0), 0.0, atol=1e-9)
    assert paired == (min(field_mm) > 60.0)


def test_wedge_is_even_in_lightness():
    values = sorted({step.reflectance for step in place_wedge(frame_around((148.4, 185.5), 20.0), 0)})
    lightness = 116.0 * np.cbrt(values) - 16.0
    np.testing.assert_allclose(np.diff(lightness), np.diff(lightness)[0], atol=0.01)


def test_ids_of_large_frames_stay_in_the_dictionary():
    markers = place_markers(frame_around((900.0, 900.0), 20.0))
    assert max(marker.id for marker in markers) < 50
