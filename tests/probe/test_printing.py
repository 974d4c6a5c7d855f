"""The PDFs are at true scale, print the linear values, and their marks coincide."""

import re

import numpy as np
import pytest

from arlight.color import linear_from_encoded
from arlight.probe.layout import design_probe
from arlight.probe.pages import PAGE_MM, PRINT_MARGIN_MM
from arlight.probe.printing import write_pdfs
from arlight.probe.rasters import render_rasters

POINT_MM = 25.4 / 72.0
NUMBER = r"(-?[\d.]+)"


@pytest.fixture(scope="module")
def probe():
    return design_probe(1, pixels_per_mm=10.0)


@pytest.fixture(scope="module")
def rasters(probe):
    return render_rasters(probe)


@pytest.fixture(scope="module", params=["a4", "letter"])
def pages(request, probe, rasters, tmp_path_factory, read_pdf):
    paths = write_pdfs(probe, rasters, tmp_path_factory.mktemp("pdf"), request.param)
    return request.param, {path.stem: read_pdf(path) for path in paths}


def lines_mm(pdf):
    """Straight lines of the page, in mm."""
    found = re.findall(rf"n {NUMBER} {NUMBER} m {NUMBER} {NUMBER} l S", pdf.drawing)
    return np.array([[float(number) * POINT_MM for number in line] for line in found]).reshape(-1, 2, 2)


def test_each_is_one_page_of_the_right_size(pages):
    paper, layers = pages
    assert set(layers) == {"top", "bottom", "frame"}
    for pdf in layers.values():
        assert pdf.pages == 1
        np.testing.assert_allclose(np.array(pdf.page_pt) * POINT_MM, PAGE_MM[paper], atol=0.01)


def test_layers_are_at_true_scale_and_centred(pages, probe):
    paper, layers = pages
    for pdf in layers.values():
        matrix = re.search(rf"{NUMBER} 0 0 {NUMBER} {NUMBER} {NUMBER} cm\n/FormXob", pdf.drawing)
        width, height, left, bottom = (float(number) * POINT_MM for number in matrix.groups())
        np.testing.assert_allclose((width, height), probe.sheet_mm, atol=1e-3)
        assert 2.0 * left + width == pytest.approx(PAGE_MM[paper][0], abs=1e-3)
        assert bottom > PRINT_MARGIN_MM
        assert bottom + height < PAGE_MM[paper][1] - PRINT_MARGIN_MM


def test_printed_values_are_srgb_of_the_linear_ones(pages, rasters):
    _, layers = pages
    rows, columns = rasters.film.shape
    for layer, raster in (("top", rasters.film), ("bottom", rasters.paper), ("frame", rasters.frame)):
        (size, samples), *others = layers[layer].images.items()
        assert size == (columns, rows)
        assert not others
        encoded = np.frombuffer(samples, np.uint8).reshape(rows, columns) / 255.0
        # half a level of the encoded scale is at most 0.45 % of linear light, at white
        np.testing.assert_allclose(linear_from_encoded(encoded), raster, atol=0.0046)


def test_ruler_is_100_mm_long_with_a_tick_a_millimetre(pages):
    for pdf in pages[1].values():
        lines = lines_mm(pdf)
        horizontal = lines[np.abs(lines[:, 0, 1] - lines[:, 1, 1]) < 1e-6]
        ruler = horizontal[np.argmax(np.ptp(horizontal[..., 0], axis=1))]
        assert np.ptp(ruler[:, 0]) == pytest.approx(100.0, abs=1e-3)
        on_ruler = lines[(np.abs(lines[:, 0, 1] - ruler[0, 1]) < 1e-3) & (np.ptp(lines[..., 1], axis=1) > 1.0)]
        np.testing.assert_allclose(np.diff(np.sort(on_ruler[:, 0, 0])), 1.0, atol=1e-3)
        assert len(on_ruler) == 101


def test_marks_coincide_when_the_film_is_turned_over(pages):
    paper, layers = pages

    def marks(pdf, mirrored):
        lines = lines_mm(pdf)
        lines = lines[lines[..., 1].min(axis=1) > PRINT_MARGIN_MM + 10.0]
        if mirrored:
            lines[..., 0] = PAGE_MM[paper][0] - lines[..., 0]
        # the lines are horizontal or vertical: sorting each coordinate only swaps their ends
        return {tuple(np.sort(np.round(line, 2), axis=0).ravel()) for line in lines}

    bottom, top = marks(layers["bottom"], False), marks(layers["top"], True)
    # two lines at each corner, two in each of the four crosses
    assert len(bottom) == 16
    assert bottom == top == marks(layers["frame"], False)


def test_marks_stay_off_the_sheet_and_within_the_printable_page(pages):
    paper, layers = pages
    width, height = PAGE_MM[paper]
    pdf = layers["bottom"]
    matrix = re.search(rf"{NUMBER} 0 0 {NUMBER} {NUMBER} {NUMBER} cm\n/FormXob", pdf.drawing)
    sheet_width, sheet_height, left, bottom = (float(number) * POINT_MM for number in matrix.groups())
    lines = lines_mm(pdf)
    x, y = lines[..., 0], lines[..., 1]
    outside = (x.max(1) <= left) | (x.min(1) >= left + sheet_width)
    outside |= (y.max(1) <= bottom) | (y.min(1) >= bottom + sheet_height)
    # the crop marks run along the sheet's edges, outside its corners
    assert np.all(outside)
    assert x.min() >= PRINT_MARGIN_MM
    assert x.max() <= width - PRINT_MARGIN_MM
    assert y.min() >= PRINT_MARGIN_MM
    assert y.max() <= height - PRINT_MARGIN_MM


def test_film_alone_is_mirrored_and_only_if_wanted(pages, probe, rasters, tmp_path, read_pdf):
    paper, layers = pages
    mirror = "-1 0 0 1 "
    assert mirror in layers["top"].drawing
    assert mirror not in layers["bottom"].drawing
    assert mirror not in layers["frame"].drawing
    plain = {path.stem: read_pdf(path) for path in write_pdfs(probe, rasters, tmp_path, paper, mirror_film=False)}
    assert mirror not in plain["top"].drawing


def test_title_says_what_it_is_and_how_to_print_it(pages):
    for layer, name in (("top", "FILM"), ("bottom", "PAPER"), ("frame", "FRAME")):
        assert name in pages[1][layer].drawing
        assert "PRINT AT 100 %" in pages[1][layer].drawing


def test_largest_sheet_of_a_page_keeps_its_marks_printable(tmp_path, read_pdf):
    probe = design_probe(5, pixels_per_mm=10.0)
    # the layers' content does not matter here: coarse ones do
    coarse = render_rasters(design_probe(1, pixels_per_mm=5.0))
    for paper in ("a4", "letter"):
        path = write_pdfs(probe, coarse, tmp_path, paper)[1]
        lines = lines_mm(read_pdf(path)).reshape(-1, 2)
        assert np.all(lines >= PRINT_MARGIN_MM)
        assert np.all(lines <= np.array(PAGE_MM[paper]) - PRINT_MARGIN_MM)
