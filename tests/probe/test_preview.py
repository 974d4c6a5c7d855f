"""The preview shows the sheet: dark patterns, white paper, a frame whose fiducials are found."""

import cv2
import numpy as np
import pytest

from arlight.color import linear_from_encoded
from arlight.probe.layout import design_probe
from arlight.probe.preview import preview_image
from arlight.probe.rasters import render_rasters


@pytest.fixture(scope="module")
def probe():
    return design_probe(1, pixels_per_mm=10.0)


@pytest.fixture(scope="module")
def picture(probe):
    return np.asarray(preview_image(probe, render_rasters(probe)))


def window_mean(picture, block):
    """Mean linear value over the block's window; the sheet is centred in the picture, 6 pixels a mm."""
    rows, columns = picture.shape[:2]
    x, y, half = columns / 2.0 + block.center_mm[0] * 6.0, rows / 2.0 - block.center_mm[1] * 6.0, block.window_mm * 3.0
    patch = picture[round(y - half) : round(y + half), round(x - half) : round(x + half), 1]
    return float(linear_from_encoded(patch / 255.0).mean())


def test_blocks_look_as_an_even_sky_makes_them(probe, picture):
    slab = probe.slab
    # received lighting of an even sky, by a fine sum over the light plane that shares nothing with the preview's rings
    axis = (np.arange(201) + 0.5) / 201 - 0.5
    delta = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    weight = slab.received_weight(delta)
    white = np.mean([window_mean(picture, b) for b in probe.blocks if b.kind == "clear_white"])
    # white paper under clear film
    assert white == pytest.approx(0.9 * 0.95**2, abs=0.01)
    for block in probe.blocks:
        if block.kind != "pattern":
            continue
        ratio = (weight @ np.cos(2.0 * np.pi * delta @ np.array(block.frequency))) / weight.sum()
        cos_tau = np.cos(np.radians(block.phase_deg))
        expected = (1.0 + (ratio * cos_tau + ratio + cos_tau) / 2.0) / 8.0
        assert window_mean(picture, block) / white == pytest.approx(expected, abs=0.012)


def test_fiducials_are_found_in_it(probe, picture):
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    _, ids, _ = detector.detectMarkers(np.ascontiguousarray(picture))
    assert sorted(ids.ravel()) == [marker.id for marker in probe.markers]


def test_large_sheets_give_a_picture_of_bounded_size():
    probe = design_probe(6, pixels_per_mm=6.0, glass_mm=5.0)
    picture = preview_image(probe, render_rasters(probe))
    assert max(picture.size) <= 2200
