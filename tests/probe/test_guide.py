"""The guide is one page that states the stack."""

import re

import pytest

from arlight.probe.guide import write_guide
from arlight.probe.layout import design_probe
from arlight.probe.pages import PAGE_MM


@pytest.mark.parametrize("paper", ["a4", "letter"])
@pytest.mark.parametrize("mirror_film", [True, False])
def test_one_page_with_everything_on_it(tmp_path, read_pdf, paper, mirror_film):
    write_guide(
        design_probe(3, "doubled", glass_mm=1.9876, refractive_index=1.491), tmp_path / "guide.pdf", paper, mirror_film
    )
    pdf = read_pdf(tmp_path / "guide.pdf")
    assert pdf.pages == 1
    assert pdf.page_pt[1] * 25.4 / 72.0 == pytest.approx(PAGE_MM[paper][1], abs=0.01)
    for word in ("1.9876 mm", "1.491", "doubled", "Frame", "Film", "Glass", "Paper", "100.0 mm"):
        assert word in pdf.drawing
    assert ("ink down" in pdf.drawing) == mirror_film
    assert ("unmirrored" in pdf.drawing) != mirror_film
    # the lowest paragraph ends above the printer's margin
    heights = [float(y) for y in re.findall(r"\n1 0 0 1 [\d.]+ (-?[\d.]+) cm", pdf.drawing)]
    assert min(heights) > 15.0 / 25.4 * 72.0


@pytest.mark.parametrize("paper", ["a4", "letter"])
def test_notes_on_the_printer_fit_the_page(tmp_path, read_pdf, paper):
    notes = ["Predicted error of the light's coefficients by order, single frame: " + "0: 12.3 %, " * 9] + [
        "What helps: print with more than 600 dpi, or a lower order, or thicker glass. " * 2
    ] * 2
    write_guide(design_probe(5), tmp_path / "guide.pdf", paper, dpi=600.0, notes=notes)
    pdf = read_pdf(tmp_path / "guide.pdf")
    assert pdf.pages == 1
    for words in ("600 dpi", "This printer", "What helps"):
        assert words in pdf.drawing
    assert "encoded for sRGB" not in pdf.drawing
    heights = [float(y) for y in re.findall(r"\n1 0 0 1 [\d.]+ (-?[\d.]+) cm", pdf.drawing)]
    assert min(heights) > 10.0 / 25.4 * 72.0
