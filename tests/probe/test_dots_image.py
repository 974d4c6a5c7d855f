"""Halftoned pages hold one bit a dot, on the printer's grid, equal in all layers."""

import re
from dataclasses import replace

import numpy as np
import pytest

from arlight.probe.halftone import render_halftones
from arlight.probe.layout import design_probe
from arlight.probe.printing import write_pdfs

NUMBER = r"(-?[\d.]+)"


@pytest.fixture(scope="module", params=[(300, "a4"), (600, "letter")], ids=str)
def printed(request, tmp_path_factory, read_pdf):
    dpi, paper = request.param
    dots = render_halftones(design_probe(1, pixels_per_mm=dpi / 25.4))
    probe = design_probe(1, pixels_per_mm=dpi / 25.4)
    paths = write_pdfs(probe, dots, tmp_path_factory.mktemp("pdf"), paper)
    return dpi, dots, {path.stem: (read_pdf(path), path.read_bytes()) for path in paths}


def test_every_dot_is_one_bit_of_the_image(printed):
    _, dots, pages = printed
    for name, layer in (("top", dots.film), ("bottom", dots.paper), ("frame", dots.frame)):
        pdf, content = pages[name]
        ((size, samples),) = pdf.images.items()
        assert size == layer.shape[::-1]
        rows, columns = layer.shape
        bits = np.unpackbits(np.frombuffer(samples, np.uint8).reshape(rows, -1), axis=1)[:, :columns]
        np.testing.assert_array_equal(bits > 0, layer)
        assert b"/BitsPerComponent 1" in content
        assert b"/Interpolate true" not in content


def test_dots_fall_on_the_printers_dots(printed):
    dpi, dots, pages = printed
    rows, columns = dots.film.shape
    places = []
    for pdf, _ in pages.values():
        matrix = re.search(rf"{NUMBER} 0 0 {NUMBER} {NUMBER} {NUMBER} cm\n/FormXob", pdf.drawing)
        width, height, left, bottom = (float(number) * dpi / 72.0 for number in matrix.groups())
        page = np.array(pdf.page_pt) * dpi / 72.0
        # the page is whole dots, so that dots counted from its top or its left are whole too
        np.testing.assert_allclose(page, np.round(page), atol=1e-3)
        # drawn smaller by a fiftieth of a dot, inside its own dots
        for low, size, count in ((left, width, columns), (bottom, height, rows)):
            assert 0.001 < low - np.floor(low) < 0.05
            assert np.ceil(low + size) - np.floor(low) == count
            assert 0.001 < np.ceil(low + size) - (low + size) < 0.05
        # mirrored about the page's middle it comes to the same place
        assert left + width / 2.0 == pytest.approx(page[0] / 2.0, abs=1e-3)
        places.append((left, bottom))
    np.testing.assert_allclose(places, np.broadcast_to(places[0], (3, 2)), atol=1e-6)


def test_title_names_the_resolution(printed):
    dpi, _, pages = printed
    for pdf, _ in pages.values():
        assert f"{dpi} dpi" in pdf.drawing


def test_layout_of_coarser_rasters_is_whole_dots():
    probe = design_probe(1, pixels_per_mm=600 / 25.4)
    fine = replace(probe, pixels_per_mm=2.0 * probe.pixels_per_mm)
    dots = render_halftones(fine)
    np.testing.assert_allclose(np.array(dots.film.shape[::-1]) / 1200 * 25.4, probe.sheet_mm, atol=1e-9)
    # markers are printed to the dot: the same at either resolution
    coarse = render_halftones(probe).frame
    marker = np.array(probe.markers[0].corners_mm)
    corner = np.array([marker[0, 0] + probe.sheet_mm[0] / 2.0, probe.sheet_mm[1] / 2.0 - marker[0, 1]]) * 600 / 25.4
    left, top = np.round(corner).astype(int)
    side = round((marker[1, 0] - marker[0, 0]) * 600 / 25.4)
    part = coarse[top : top + side, left : left + side]
    double = dots.frame[2 * top : 2 * (top + side), 2 * left : 2 * (left + side)]
    np.testing.assert_array_equal(part.repeat(2, axis=0).repeat(2, axis=1), double)
