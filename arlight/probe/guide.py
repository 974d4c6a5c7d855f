"""guide.pdf: one page that says how to print the layers, stack them and check the result."""

from collections.abc import Sequence
from pathlib import Path

from reportlab.lib.enums import TA_LEFT
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Paragraph

from arlight.probe.design import Probe
from arlight.probe.pages import PAGE_MM, Paper
from arlight.probe.stack_drawing import draw_stack

_MARGIN_MM = 18.0
_TEXT = ParagraphStyle("text", fontName="Helvetica", fontSize=9.2, leading=11.8, alignment=TA_LEFT)
_STEP = ParagraphStyle("step", parent=_TEXT, leftIndent=14, bulletIndent=0, spaceAfter=2)
_HEADING = ParagraphStyle("heading", parent=_TEXT, fontName="Helvetica-Bold", fontSize=11.5, leading=15)
_DRAWING_MM = 66.0


def write_guide(
    probe: Probe,
    path: Path,
    paper: Paper,
    mirror_film: bool = True,
    dpi: float | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write the assembly guide.

    Args:
        probe: the sheet.
        path: guide.pdf.
        paper: page to print on.
        mirror_film: whether top.pdf is mirrored.
        dpi: resolution of the layers' dots; None where they are grey.
        notes: what else there is to say about this printer, one paragraph each.

    Raises:
        OSError: the file cannot be written.
    """
    width, height = PAGE_MM[paper]
    canvas = Canvas(str(path), pagesize=(width * mm, height * mm), invariant=1)
    canvas.setTitle("arlight probe, assembly guide")
    canvas.setFont("Helvetica-Bold", 17)
    canvas.drawString(_MARGIN_MM * mm, (height - 21.0) * mm, "The planar light probe: how to build it")
    y = _flow(canvas, [Paragraph(_summary(probe), _TEXT)], width, height - 25.0) - 3.0
    draw_stack(canvas, probe, (_MARGIN_MM, y - _DRAWING_MM), (width - 2.0 * _MARGIN_MM, _DRAWING_MM), mirror_film)
    y -= _DRAWING_MM + 3.0
    sections = {
        "You need": _materials(probe),
        "Print and build": _steps(mirror_film, dpi),
        "Check": _checks(probe),
    }
    if notes:
        sections["This printer"] = list(notes)
    for heading, lines in sections.items():
        y = _flow(canvas, [Paragraph(heading, _HEADING)], width, y)
        numbered = heading == "Print and build"
        bullets = [f"{i}." if numbered else "\u2022" for i in range(1, len(lines) + 1)]
        paragraphs = [Paragraph(line, _STEP, bulletText=b) for line, b in zip(lines, bullets, strict=True)]
        y = _flow(canvas, paragraphs, width, y) - 2.0
    canvas.showPage()
    canvas.save()


def _flow(canvas: Canvas, paragraphs: list[Paragraph], page_width_mm: float, top_mm: float) -> float:
    """Draw paragraphs below each other; returns where the next one begins [mm]."""
    available = (page_width_mm - 2.0 * _MARGIN_MM) * mm
    for paragraph in paragraphs:
        _, height = paragraph.wrap(available, 1000 * mm)
        top_mm -= height / mm
        paragraph.drawOn(canvas, _MARGIN_MM * mm, top_mm * mm)
        top_mm -= paragraph.style.spaceAfter / mm
    return top_mm


def _summary(probe: Probe) -> str:
    count = sum(block.kind == "pattern" for block in probe.blocks)
    return (
        f"Sheet of {probe.sheet_mm[0]:.1f} x {probe.sheet_mm[1]:.1f} mm, design <i>{probe.design}</i>, order "
        f"{probe.order}, {count} patterned blocks. The patterns on the film and on the paper, a pane of glass apart, "
        "brighten and darken each block according to where light comes from; a camera that sees the sheet can read the "
        "lighting off it."
    )


def _materials(probe: Probe) -> list[str]:
    width, height = probe.sheet_mm
    return [
        f"Clear glass or acrylic, <b>{probe.glass_mm:g} mm</b> thick, refractive index "
        f"<b>{probe.refractive_index:g}</b>, at least {width:.0f} x {height:.0f} mm. If yours differs by more than "
        f"{0.01 * probe.glass_mm:.2g} mm (use a caliper) or is of another material, write the probe again with its "
        "values.",
        "One clear transparency for the printer, one sheet of matte white paper without gloss or texture, one sheet of "
        "heavy matte white paper (160 g/m\u00b2 or more) for the frame.",
        "A sharp knife, a steel ruler, clear tape, a dark flat surface.",
    ]


def _steps(mirror_film: bool, dpi: float | None) -> list[str]:
    ink = (
        "The film is printed <b>mirrored</b>: turn it over, so that its <b>ink lies on the glass</b> and its title "
        "reads the right way round."
        if mirror_film
        else "The film is printed unmirrored: its <b>ink faces up</b>, away from the glass."
    )
    tones = (
        "The grey levels are encoded for sRGB, as printers expect: apply no other correction."
        if dpi is None
        else f"The pages are black dots of <b>{dpi:.0f} dpi</b>: set the printer to that resolution, and switch off "
        "smoothing, resolution enhancement and every correction."
    )
    return [
        "Print bottom.pdf on paper, top.pdf on the transparency and frame.pdf on heavy paper, all on the same printer, "
        "at <b>100\u00a0% (actual size)</b>, best quality, black ink only, page-fitting and toner-saving options off. "
        + tones,
        "Lay a steel ruler on each printed ruler: it must measure <b>100.0 mm</b>. If not, scaling is still on.",
        "Cut out the frame's window along the thin line. Trim the layers along their corner marks once film and paper "
        "are taped: until then the marks and crosses in the margin are needed.",
        "Stack from below: paper (ink up), glass, film, frame (ink up). " + ink,
        "Align film and paper: look straight down on each cross and corner mark in turn with one eye, and shift the "
        "film until the marks of film and paper coincide on all sides. Tape the film, then the paper, to the glass. A "
        "tenth of a millimetre matters; what is left is found by calibration.",
        "Lay the frame on the film so that an equal, narrow black line shows on all four sides of the window, and tape "
        "it at its outer edge, off the fiducials.",
    ]


def _checks(probe: Probe) -> list[str]:
    white = sum(block.kind == "clear_white" for block in probe.blocks)
    return [
        f"From straight above in even light the sheet looks like preview.png; {white} plain blocks are white.",
        "Paper and film touch the glass everywhere, pressed flat with card from behind: a gap acts like thicker glass.",
        "Frame and paper are matte: fiducials and grey steps must not mirror a lamp.",
        "When filming: all of the sheet in view, at most 70 degrees off its normal, exposure and white balance locked.",
    ]
