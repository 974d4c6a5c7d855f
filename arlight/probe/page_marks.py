"""What surrounds a sheet on its page: where it lies, crop marks, registration crosses, a ruler and a title."""

from dataclasses import dataclass

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from arlight.probe.pages import MARK_BAND_MM, PAGE_MM, PRINT_MARGIN_MM, RULER_BAND_MM, TITLE_BAND_MM, Paper

_RULER_MM = 100
_HAIRLINE_MM = 0.1
_CROP_GAP_MM = 0.8
_CROP_LENGTH_MM = 3.6
_CROSS_RADIUS_MM = 1.7


@dataclass(frozen=True, slots=True)
class Placement:
    """Where the sheet lies on the page, in PDF coordinates: origin at the bottom left, y up [mm]."""

    page_mm: tuple[float, float]
    """Width and height of the page."""
    left_mm: float
    """Left edge of the sheet; the sheet is centred, so it is the right edge's distance too."""
    bottom_mm: float
    """Lower edge of the sheet."""
    sheet_mm: tuple[float, float]
    """Width and height of the sheet."""


def placement(sheet_mm: tuple[float, float], paper: Paper, dot_mm: float | None = None) -> Placement:
    """The sheet in the middle of what title and ruler leave of the page.

    Args:
        sheet_mm: width and height of the sheet.
        paper: the page.
        dot_mm: pitch of the printer's dots, of which the sheet's width is an even number. The page, by a dot at most,
            and the sheet's place on it are then whole dots, so that the sheet's dots fall on the printer's.
    """
    (page_width, page_height), (width, height) = PAGE_MM[paper], sheet_mm
    if dot_mm is not None:
        page_width = 2.0 * round(page_width / (2.0 * dot_mm)) * dot_mm
        page_height = round(page_height / dot_mm) * dot_mm
    low = PRINT_MARGIN_MM + RULER_BAND_MM
    high = page_height - PRINT_MARGIN_MM - TITLE_BAND_MM
    bottom = (low + high - height) / 2.0
    if dot_mm is not None:
        bottom = round(bottom / dot_mm) * dot_mm
    return Placement((page_width, page_height), (page_width - width) / 2.0, bottom, (width, height))


def draw_crop_marks(canvas: Canvas, where: Placement) -> None:
    """Lines outside the corners that continue the sheet's edges."""
    canvas.setLineWidth(_HAIRLINE_MM * mm)
    canvas.setStrokeGray(0.0)
    width, height = where.sheet_mm
    for x, outward_x in ((where.left_mm, -1), (where.left_mm + width, 1)):
        for y, outward_y in ((where.bottom_mm, -1), (where.bottom_mm + height, 1)):
            near, far = _CROP_GAP_MM, _CROP_GAP_MM + _CROP_LENGTH_MM
            canvas.line((x + near * outward_x) * mm, y * mm, (x + far * outward_x) * mm, y * mm)
            canvas.line(x * mm, (y + near * outward_y) * mm, x * mm, (y + far * outward_y) * mm)


def draw_crosses(canvas: Canvas, where: Placement) -> None:
    """A cross in a circle outside the middle of each side."""
    canvas.setLineWidth(_HAIRLINE_MM * mm)
    width, height = where.sheet_mm
    x, y, out = where.left_mm + width / 2.0, where.bottom_mm + height / 2.0, MARK_BAND_MM / 2.0
    centres = [
        (x, where.bottom_mm - out),
        (x, where.bottom_mm + height + out),
        (where.left_mm - out, y),
        (where.left_mm + width + out, y),
    ]
    for cx, cy in centres:
        arm = MARK_BAND_MM / 2.0 - 0.2
        canvas.circle(cx * mm, cy * mm, _CROSS_RADIUS_MM * mm)
        canvas.line((cx - arm) * mm, cy * mm, (cx + arm) * mm, cy * mm)
        canvas.line(cx * mm, (cy - arm) * mm, cx * mm, (cy + arm) * mm)


def draw_ruler(canvas: Canvas, where: Placement) -> None:
    """A ruler in the middle below the sheet, to hold a real one against."""
    left, base = (where.page_mm[0] - _RULER_MM) / 2.0, PRINT_MARGIN_MM + 3.0
    canvas.setLineWidth(_HAIRLINE_MM * mm)
    canvas.line(left * mm, base * mm, (left + _RULER_MM) * mm, base * mm)
    canvas.setFont("Helvetica", 6)
    for tick in range(_RULER_MM + 1):
        length = 4.0 if tick % 10 == 0 else 3.0 if tick % 5 == 0 else 2.0
        canvas.line((left + tick) * mm, base * mm, (left + tick) * mm, (base + length) * mm)
        if tick % 10 == 0:
            canvas.drawCentredString((left + tick) * mm, (base - 2.4) * mm, f"{tick}")
    canvas.drawString((left + _RULER_MM + 2.0) * mm, base * mm, "mm: must measure 100.0")


def draw_title(canvas: Canvas, where: Placement, title: str, direction: str) -> None:
    """Two lines at the top of the page: what it is, and what to do with it."""
    top = where.page_mm[1] - PRINT_MARGIN_MM
    canvas.setFillGray(0.0)
    for text, font, size, below in ((title, "Helvetica-Bold", 8.5, 3.2), (direction, "Helvetica", 8, 7.0)):
        canvas.setFont(font, size)
        canvas.drawCentredString(where.page_mm[0] / 2.0 * mm, (top - below) * mm, text)
