"""A drawing of the stack from the side, layers pulled apart, with the path of light through it."""

import numpy as np
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from arlight.probe.design import Probe

_LIGHT_DEG, _VIEW_DEG = 50.0, 25.0


def draw_stack(
    canvas: Canvas,
    probe: Probe,
    corner_mm: tuple[float, float],
    size_mm: tuple[float, float],
    ink_on_glass: bool = True,
) -> None:
    """Draw the stack into a rectangle of the page.

    Args:
        canvas: where to draw.
        probe: whose glass is labelled and refracts.
        corner_mm: bottom left corner of the rectangle on the page [mm].
        size_mm: its width and height [mm].
        ink_on_glass: whether the film's ink faces the glass.
    """
    canvas.saveState()
    canvas.translate(corner_mm[0] * mm, corner_mm[1] * mm)
    stack, height = 0.62 * size_mm[0], size_mm[1]
    glass_low, glass_high = 0.16 * height, 0.5 * height
    _layer(canvas, 0.0, glass_low - 3.4, stack, 1.6, 0.93, stripes=True)
    _layer(canvas, 0.0, glass_low, stack, glass_high - glass_low, None)
    _layer(canvas, 0.0, glass_high + 1.8, stack, 0.9, 0.85, stripes=True)
    frame = 0.14 * stack
    for x in (0.0, stack - frame):
        _layer(canvas, x, glass_high + 9.0, frame, 1.4, 1.0)
    _rays(canvas, probe, 0.5 * stack, glass_low, glass_high, height)
    labels = (
        (glass_high + 9.2, "Frame: paper, ink up", "fiducials and grey wedge; window cut out"),
        (glass_high + 1.7, f"Film: ink {'down, on the glass' if ink_on_glass else 'up'}", "transmittance pattern"),
        ((glass_low + glass_high) / 2.0, "Glass", f"{probe.glass_mm:g} mm, index {probe.refractive_index:g}"),
        (glass_low - 3.2, "Paper: ink up, against the glass", "reflectance pattern"),
    )
    for y, name, note in labels:
        _label(canvas, stack, y, name, note)
    canvas.restoreState()


def _layer(
    canvas: Canvas, x: float, y: float, width: float, height: float, grey: float | None, stripes: bool = False
) -> None:
    canvas.setLineWidth(0.5)
    canvas.setStrokeGray(0.25)
    if grey is None:
        canvas.setFillColorRGB(0.86, 0.93, 0.95)
    else:
        canvas.setFillGray(grey)
    canvas.rect(x * mm, y * mm, width * mm, height * mm, fill=1)
    if stripes:
        canvas.setFillGray(0.1)
        count = 16
        for i in range(count):
            canvas.rect((x + (i + 0.2) * width / count) * mm, y * mm, 0.45 * width / count * mm, height * mm, 0, 1)


def _rays(canvas: Canvas, probe: Probe, foot: float, low: float, high: float, top: float) -> None:
    """Light comes down from the left to the paper at `foot`, and leaves to the viewer at the right."""
    for degrees, side, name in ((_LIGHT_DEG, -1.0, "light"), (_VIEW_DEG, 1.0, "camera")):
        sine = np.sin(np.radians(degrees))
        inside = np.tan(np.arcsin(sine / probe.refractive_index))
        crossing = foot + side * inside * (high - low)
        # ends below the rectangle's top to leave room for the name
        end = crossing + side * np.tan(np.radians(degrees)) * (top - 6.0 - high)
        canvas.setLineWidth(1.1)
        canvas.setStrokeColorRGB(*((0.85, 0.5, 0.0) if side < 0 else (0.1, 0.3, 0.7)))
        canvas.line(foot * mm, low * mm, crossing * mm, high * mm)
        canvas.line(crossing * mm, high * mm, end * mm, (top - 6.0) * mm)
        canvas.setFillGray(0.0)
        canvas.setFont("Helvetica", 9)
        canvas.drawCentredString(end * mm, (top - 4.0) * mm, name)


def _label(canvas: Canvas, x: float, y: float, name: str, note: str) -> None:
    canvas.setLineWidth(0.4)
    canvas.setStrokeGray(0.5)
    canvas.line((x + 1.0) * mm, (y + 0.5) * mm, (x + 5.0) * mm, (y + 0.5) * mm)
    canvas.setFillGray(0.0)
    canvas.setFont("Helvetica-Bold", 8.5)
    canvas.drawString((x + 6.0) * mm, y * mm, name)
    canvas.setFont("Helvetica", 7.5)
    canvas.drawString((x + 6.0) * mm, (y - 3.0) * mm, note)
