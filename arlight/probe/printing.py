"""top.pdf, bottom.pdf and frame.pdf: the layers at true scale, with registration marks and a ruler.

Each layer is an image of exactly the sheet's size in the middle of the page. Grey layers are encoded with the sRGB
curve: an ordinary print workflow reads grey levels that way and prints the linear reflectance. Halftoned layers are
bilevel and lie on the printer's own dots. The film is printed mirrored and lies with its ink on the glass, so that the
pattern is at the glass's face and not a film's thickness above it. The marks are symmetric about the page's centre
line, so they coincide in the three layers, mirrored or not.
"""

from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image
from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas

from arlight.color import encoded_from_linear
from arlight.probe.design import Probe
from arlight.probe.dots_image import draw_dots
from arlight.probe.frame_layout import window_mm
from arlight.probe.halftone import MM_PER_INCH, Bilevel, Halftones
from arlight.probe.page_marks import Placement, draw_crop_marks, draw_crosses, draw_ruler, draw_title, placement
from arlight.probe.pages import Paper
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
_HAIRLINE_MM = 0.1


def write_pdfs(
    probe: Probe, layers: Rasters | Halftones, folder: Path, paper: Paper, mirror_film: bool = True
) -> list[Path]:
    """Write top.pdf, bottom.pdf and frame.pdf.

    Args:
        probe: a sheet that fits the page.
        layers: its layers in grey, for the printer to screen, or as dots of a bilevel printer.
        folder: an existing folder.
        paper: page to print on.
        mirror_film: print the film mirrored, for ink that faces the glass.

    Raises:
        OSError: a file cannot be written.
    """
    dpi = layers.dpi if isinstance(layers, Halftones) else None
    images: dict[Layer, Raster | Bilevel] = {"top": layers.film, "bottom": layers.paper, "frame": layers.frame}
    paths = []
    for layer, image in images.items():
        path = folder / f"{layer}.pdf"
        _write_layer(path, probe, image, layer, paper, mirror_film and layer == "top", dpi)
        paths.append(path)
    return paths


def _write_layer(
    path: Path, probe: Probe, image: Raster | Bilevel, layer: Layer, paper: Paper, mirror: bool, dpi: float | None
) -> None:
    where = placement(probe.sheet_mm, paper, None if dpi is None else MM_PER_INCH / dpi)
    page_width, page_height = where.page_mm
    # invariant: the same sheet gives the same file
    canvas = Canvas(str(path), pagesize=(page_width * mm, page_height * mm), invariant=1)
    canvas.setTitle(f"arlight probe, {_TITLES[layer]}")
    if mirror:
        canvas.transform(-1, 0, 0, 1, page_width * mm, 0)
    _draw_image(canvas, image, where)
    if layer == "frame":
        _draw_window(canvas, probe, where)
    draw_crop_marks(canvas, where)
    draw_crosses(canvas, where)
    draw_ruler(canvas, where)
    draw_title(canvas, where, _title(probe, layer, paper, dpi), _DIRECTIONS[layer])
    canvas.showPage()
    canvas.save()


def _draw_image(canvas: Canvas, image: Raster | Bilevel, where: Placement) -> None:
    width, height = where.sheet_mm
    rectangle = where.left_mm * mm, where.bottom_mm * mm, width * mm, height * mm
    if image.dtype == np.bool_:
        draw_dots(canvas, np.asarray(image, bool), *rectangle)
    else:
        grey = Image.fromarray(np.round(encoded_from_linear(image) * 255.0).astype(np.uint8))
        canvas.drawImage(ImageReader(grey), *rectangle)


def _draw_window(canvas: Canvas, probe: Probe, where: Placement) -> None:
    width, height = window_mm(probe)
    left = where.left_mm + (where.sheet_mm[0] - width) / 2.0
    bottom = where.bottom_mm + (where.sheet_mm[1] - height) / 2.0
    canvas.setLineWidth(_HAIRLINE_MM * mm)
    canvas.setStrokeGray(0.6)
    canvas.rect(left * mm, bottom * mm, width * mm, height * mm)


def _title(probe: Probe, layer: Layer, paper: Paper, dpi: float | None) -> str:
    dots = "" if dpi is None else f", {dpi:.0f} dpi"
    return (
        f"{_TITLES[layer]}   arlight probe, {probe.design}, order {probe.order}, glass {probe.glass_mm:g} mm, index "
        f"{probe.refractive_index:g}   PRINT AT 100 % ({paper.upper()}, actual size{dots})"
    )
