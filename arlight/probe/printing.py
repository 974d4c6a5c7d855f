"""top.pdf, bottom.pdf and frame.pdf: the layers at true scale, with registration marks and a ruler.

Each layer is an image of exactly the sheet's size in the middle of the page, its values encoded with the sRGB curve: an
ordinary print workflow reads grey levels that way and prints the linear reflectance. The film is printed mirrored and
lies with its ink on the glass, so that the pattern is at the glass's face and not a film's thickness above it. The
marks are symmetric about the page's centre line, so they coincide in the three layers, mirrored or not.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image
from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas

from arlight.color import encoded_from_linear
from arlight.probe.design import Probe
from arlight.probe.frame_layout import window_mm
from arlight.probe.pages import MARK_BAND_MM, PAGE_MM, PRINT_MARGIN_MM, RULER_BAND_MM, TITLE_BAND_MM, Paper
from arlight.probe.patterns import Raster
from arlight.probe.rasters import Rasters

Layer = Literal["top", "bottom", "frame"]

_TITLES: dict[Layer, str] = {
    "top": "TOP layer: FILM",
    "bottom": "BOTTOM layer: PAPER",
    "frame": "FRAME",
}
_DIRECTIONS: dict[Layer, str] = {
    "top": "Print on clear transparency; lay it so that this line reads the right way round.",
    "bottom": "Print on matte white paper, ink UP under the glass.",
    "frame": "Print on heavy matte white paper, ink UP on the film. Cut out the window along the thin line.",
}
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


def placement(probe: Probe, paper: Paper) -> Placement:
    """The sheet in the middle of what title and ruler leave of the page."""
    (page_width, page_height), (width, height) = PAGE_MM[paper], probe.sheet_mm
    low = PRINT_MARGIN_MM + RULER_BAND_MM
    high = page_height - PRINT_MARGIN_MM - TITLE_BAND_MM
    return Placement(
        (page_width, page_height), (page_width - width) / 2.0, (low + high - height) / 2.0, (width, height)
    )


def write_pdfs(probe: Probe, rasters: Rasters, folder: Path, paper: Paper, mirror_film: bool = True) -> list[Path]:
    """Write top.pdf, bottom.pdf and frame.pdf.

    Args:
        probe: a sheet that fits the page.
        rasters: its layers.
        folder: an existing folder.
        paper: page to print on.
        mirror_film: print the film mirrored, for ink that faces the glass.

    Raises:
        OSError: a file cannot be written.
    """
    layers: dict[Layer, Raster] = {"top": rasters.film, "bottom": rasters.paper, "frame": rasters.frame}
    paths = []
    for layer, raster in layers.items():
        path = folder / f"{layer}.pdf"
        _write_layer(path, probe, raster, layer, paper, mirror=mirror_film and layer == "top")
        paths.append(path)
    return paths


def _write_layer(path: Path, probe: Probe, raster: Raster, layer: Layer, paper: Paper, mirror: bool) -> None:
    where = placement(probe, paper)
    page_width, page_height = where.page_mm
    # invariant: the same sheet gives the same file
    canvas = Canvas(str(path), pagesize=(page_width * mm, page_height * mm), invariant=1)
    canvas.setTitle(f"arlight probe, {_TITLES[layer]}")
    if mirror:
        canvas.transform(-1, 0, 0, 1, page_width * mm, 0)
    image = Image.fromarray(np.round(encoded_from_linear(raster) * 255.0).astype(np.uint8))
    width, height = where.sheet_mm
    canvas.drawImage(ImageReader(image), where.left_mm * mm, where.bottom_mm * mm, width * mm, height * mm)
    if layer == "frame":
        _draw_window(canvas, probe, where)
    _draw_crop_marks(canvas, where)
    _draw_crosses(canvas, where)
    _draw_ruler(canvas, where)
    _draw_title(canvas, probe, layer, paper, where)
    canvas.showPage()
    canvas.save()


def _draw_window(canvas: Canvas, probe: Probe, where: Placement) -> None:
    width, height = window_mm(probe)
    left = where.left_mm + (where.sheet_mm[0] - width) / 2.0
    bottom = where.bottom_mm + (where.sheet_mm[1] - height) / 2.0
    canvas.setLineWidth(_HAIRLINE_MM * mm)
    canvas.setStrokeGray(0.6)
    canvas.rect(left * mm, bottom * mm, width * mm, height * mm)


def _draw_crop_marks(canvas: Canvas, where: Placement) -> None:
    """Lines outside the corners that continue the sheet's edges."""
    canvas.setLineWidth(_HAIRLINE_MM * mm)
    canvas.setStrokeGray(0.0)
    width, height = where.sheet_mm
    for x, outward_x in ((where.left_mm, -1), (where.left_mm + width, 1)):
        for y, outward_y in ((where.bottom_mm, -1), (where.bottom_mm + height, 1)):
            near, far = _CROP_GAP_MM, _CROP_GAP_MM + _CROP_LENGTH_MM
            canvas.line((x + near * outward_x) * mm, y * mm, (x + far * outward_x) * mm, y * mm)
            canvas.line(x * mm, (y + near * outward_y) * mm, x * mm, (y + far * outward_y) * mm)


def _draw_crosses(canvas: Canvas, where: Placement) -> None:
    """A cross in a circle outside the middle of each side."""
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


def _draw_ruler(canvas: Canvas, where: Placement) -> None:
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


def _draw_title(canvas: Canvas, probe: Probe, layer: Layer, paper: Paper, where: Placement) -> None:
    line = (
        f"{_TITLES[layer]}   arlight probe, {probe.design}, order {probe.order}, glass {probe.glass_mm:g} mm, index "
        f"{probe.refractive_index:g}   PRINT AT 100 % ({paper.upper()}, actual size)"
    )
    top = where.page_mm[1] - PRINT_MARGIN_MM
    canvas.setFillGray(0.0)
    for text, font, size, below in ((line, "Helvetica-Bold", 8.5, 3.2), (_DIRECTIONS[layer], "Helvetica", 8, 7.0)):
        canvas.setFont(font, size)
        canvas.drawCentredString(where.page_mm[0] / 2.0 * mm, (top - below) * mm, text)
