"""The pages that a sheet is printed on, and what of them a printer and the marks around the sheet leave [mm]."""

from typing import Literal, get_args

Paper = Literal["a4", "letter"]

PAPERS: tuple[Paper, ...] = get_args(Paper)
PAGE_MM: dict[Paper, tuple[float, float]] = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
"""Width and height of each page, upright."""
PRINT_MARGIN_MM = 5.0
"""What printers leave blank along the page's edges."""
MARK_BAND_MM = 5.0
"""Band around the sheet for its registration marks."""
TITLE_BAND_MM = 9.0
"""Above the marks: the title lines."""
RULER_BAND_MM = 9.0
"""Below the marks: the ruler."""


def largest_sheet_mm(paper: Paper) -> tuple[float, float]:
    """Width and height of the largest sheet that the page takes."""
    width, height = PAGE_MM[paper]
    around = 2.0 * (PRINT_MARGIN_MM + MARK_BAND_MM)
    return width - around, height - around - TITLE_BAND_MM - RULER_BAND_MM


def fits_page(sheet_mm: tuple[float, float], paper: Paper) -> bool:
    """Whether a sheet of this width and height fits the page with marks, title and ruler."""
    width, height = largest_sheet_mm(paper)
    return sheet_mm[0] <= width and sheet_mm[1] <= height
