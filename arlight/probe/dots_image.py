"""A bilevel image in a PDF, one bit a dot: reportlab itself writes eight, which printer drivers may screen again."""

import hashlib
import zlib

import numpy as np
from reportlab.pdfbase.pdfdoc import PDFImageXObject
from reportlab.pdfgen.canvas import Canvas

from arlight.probe.halftone import Bilevel

_INSET_DOTS = 0.01
"""Interpreters widen an image whose edge lies exactly between two dots by a dot, and double a row of it."""


def draw_dots(canvas: Canvas, dots: Bilevel, x: float, y: float, width: float, height: float) -> None:
    """Draw dots into a rectangle of the page.

    Args:
        canvas: where to draw.
        dots: (rows, columns), True where nothing is printed; row 0 on top.
        x, y: bottom left corner of the rectangle; width, height: its size [points].
    """
    packed = np.packbits(dots, axis=1).tobytes()
    name = hashlib.sha256(packed).hexdigest()[:32]
    image = PDFImageXObject(name)
    image.height, image.width = dots.shape
    image.bitsPerComponent, image.colorSpace = 1, "DeviceGray"
    image.streamContent = zlib.compress(packed, 9)
    image._filters = ("FlateDecode",)
    # as drawImage registers its own
    document = canvas._doc
    document.Reference(image, document.getXObjectName(name))
    document.addForm(name, image)
    image.XObjects = None
    canvas.saveState()
    rows, columns = dots.shape
    inset_x, inset_y = _INSET_DOTS * width / columns, _INSET_DOTS * height / rows
    canvas.translate(x + inset_x, y + inset_y)
    canvas.scale(width - 2.0 * inset_x, height - 2.0 * inset_y)
    canvas.doForm(name)
    canvas.restoreState()
