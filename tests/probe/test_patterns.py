"""The printed patterns, against the closed response of the design and against a detector of fiducials."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from arlight.probe.design import Block, Marker
from arlight.probe.layout import design_probe
from arlight.probe.patterns import (
    film,
    film_transmittance,
    frame,
    paper,
    paper_reflectance,
    raster_shape,
)


@pytest.fixture(scope="module")
def small():
    return design_probe(2, pixels_per_mm=10.0)


def mean_response(design, tau, a, b):
    """Mean over a period of f(p + D(w)) g(p) f(p + D(v)), a and b the phases of light and viewer, by summation."""
    phase = 2.0 * np.pi * np.arange(96) / 96
    return np.mean(
        film_transmittance(phase + a, design)
        * paper_reflectance(phase, tau, design)
        * film_transmittance(phase + b, design),
        dtype=float,
    )


def test_matched_layers_respond_as_derived():
    for tau, a, b in np.random.default_rng(1).uniform(-np.pi, np.pi, (50, 3)):
        expected = (1.0 + (np.cos(a - tau) + np.cos(a - b) + np.cos(b - tau)) / 2.0) / 8.0
        assert mean_response("matched", tau, a, b) == pytest.approx(expected, abs=1e-7)


def test_doubled_layers_respond_as_derived():
    # holds only if the paper's stripes are twice as fine as the film's
    for tau, a, b in np.random.default_rng(2).uniform(-np.pi, np.pi, (50, 3)):
        expected = (1.0 + np.cos(a - b) / 2.0 - np.sin(tau - a - b) / 4.0) / 8.0
        assert mean_response("doubled", tau, a, b) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_pixels_sample_global_phases_at_their_centres(design):
    probe = design_probe(2, design, pixels_per_mm=10.0)
    top, bottom = film(probe), paper(probe)
    rng = np.random.default_rng(3)
    (width, height), period = probe.sheet_mm, probe.slab.period_mm
    for block in probe.blocks:
        if block.frequency is None:
            continue
        x, y = np.array(block.center_mm) + rng.uniform(-0.49, 0.49, 2) * block.size_mm
        column, row = int((x + width / 2.0) * 10.0), int((height / 2.0 - y) * 10.0)
        centre = (column + 0.5) / 10.0 - width / 2.0, height / 2.0 - (row + 0.5) / 10.0
        phi, tau = 2.0 * np.pi * np.dot(block.frequency, centre) / period, np.radians(block.phase_deg)
        f = (1.0 + np.cos(phi)) / 2.0 if design == "matched" else (1.0 - np.sin(phi)) / 2.0
        g = (1.0 + np.cos(phi + tau)) / 2.0 if design == "matched" else (1.0 + np.sin(2.0 * phi + tau)) / 2.0
        # a pixel's centre may fall across the block's edge; the draw keeps 1 % of a block away from it
        assert top[row, column] == pytest.approx(f, abs=1e-5)
        assert bottom[row, column] == pytest.approx(g, abs=1e-5)


def test_references_are_what_their_names_say(small):
    top, bottom = film(small), paper(small)
    for block in small.blocks:
        if block.kind in ("pattern", "wedge"):
            continue
        x, y = block.center_mm
        row, column = int((small.sheet_mm[1] / 2.0 - y) * 10.0), int((x + small.sheet_mm[0] / 2.0) * 10.0)
        around = slice(row - 50, row + 50), slice(column - 50, column + 50)
        above, below = block.kind.split("_")
        assert np.all(top[around] == {"clear": 1.0, "black": 0.0}[above])
        assert np.all(bottom[around] == {"white": 1.0, "black": 0.0}[below])


@pytest.mark.parametrize("pixels_per_mm", [7.3, 10.0, 11.811, 20.0])
def test_neighbouring_blocks_leave_no_line_between_them(pixels_per_mm):
    probe = design_probe(1, pixels_per_mm=pixels_per_mm)
    black = tuple(
        Block(b.id, "clear_black", b.center_mm, b.size_mm, b.window_mm) for b in probe.blocks if b.kind != "wedge"
    )
    bottom = paper(replace(probe, blocks=black))
    rows, columns = np.nonzero(bottom == 0.0)
    assert len(rows) == (np.ptp(rows) + 1) * (np.ptp(columns) + 1)


def test_film_is_black_in_the_gap_between_field_and_frame(small):
    _, window = frame(small)
    top = film(small)
    field = [b for b in small.blocks if b.kind != "wedge"]
    half = [max(b.center_mm[axis] + b.size_mm / 2.0 for b in field) for axis in (0, 1)]
    rows, columns = raster_shape(small)
    x = np.abs((np.arange(columns) + 0.5) / 10.0 - small.sheet_mm[0] / 2.0)
    y = np.abs((np.arange(rows) + 0.5) / 10.0 - small.sheet_mm[1] / 2.0)
    outside = (x[None, :] > half[0]) | (y[:, None] > half[1])
    assert np.any(window & outside)
    assert np.all(top[window & outside] == 0.0)
    # no light that enters beyond the black band reaches paper below the window
    reach = small.slab.max_offset_mm
    band = (x[None, :] < half[0] + 0.4 + reach) & (y[:, None] < half[1] + 0.4 + reach)
    assert np.all(top[outside & band] == 0.0)


def test_detector_finds_every_fiducial_at_its_corners(small):
    reflectance, window = frame(small)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    corners, ids, _ = detector.detectMarkers((np.where(window, 0.0, reflectance) * 255).astype(np.uint8))
    assert sorted(ids.ravel()) == [marker.id for marker in small.markers]
    for found, number in zip(corners, ids.ravel(), strict=True):
        expected = np.array(small.markers[number].corners_mm) * (10.0, -10.0) + np.array(small.sheet_mm) * 5.0 - 0.5
        # the detector's contours run through pixel centres inside the black
        np.testing.assert_allclose(found[0], expected, atol=1.0)


def test_fiducials_may_be_turned(small):
    turned = tuple(Marker(m.id, (*m.corners_mm[1:], m.corners_mm[0])) for m in small.markers)
    reflectance, _ = frame(replace(small, markers=turned))
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    corners, ids, _ = detector.detectMarkers((reflectance * 255).astype(np.uint8))
    first = dict(zip(ids.ravel(), corners, strict=True))[0][0][0]
    top_right = np.array(small.markers[0].corners_mm[1]) * (10.0, -10.0) + np.array(small.sheet_mm) * 5.0 - 0.5
    np.testing.assert_allclose(first, top_right, atol=1.0)


def test_wedge_has_its_reflectances(small):
    reflectance, window = frame(small)
    for block in small.blocks:
        if block.reflectance is None:
            continue
        x, y = block.center_mm
        row, column = round((small.sheet_mm[1] / 2.0 - y) * 10.0), round((x + small.sheet_mm[0] / 2.0) * 10.0)
        half = round(block.size_mm * 5.0)
        step = slice(row - half, row + half), slice(column - half, column + half)
        np.testing.assert_allclose(reflectance[step], block.reflectance, atol=1e-6)
        assert not np.any(window[step])
