"""wedge.pdf: a page of even tones, printed with the sheet's own dots, from which a printer's tone curve is measured.

Every tone stands twice, at points opposite each other about the page's centre, with unprinted paper on both sides:
light that falls off across the page cancels. Four fiducials tell where the patches are, and their numbers the dots.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from arlight.errors import OutputError
from arlight.probe.dots_image import draw_dots
from arlight.probe.halftone import MM_PER_INCH, Bilevel, even_tone
from arlight.probe.page_marks import draw_crop_marks, draw_crosses, draw_ruler, draw_title, placement
from arlight.probe.pages import Paper
from arlight.probe.resolution import RESOLUTIONS, Dpi
from arlight.probe.tone import ToneCurve

Array = NDArray[np.float64]

DICTIONARY = "DICT_5X5_50"
"""Another one than the sheet's: the two pages are never taken for each other."""
PATCH_MM = 12.0
GAP_MM = 7.0
"""Unprinted paper between patches."""
MARKER_MM = 14.0

_COLUMNS, _ROWS = 7, 4
_PITCH_MM = PATCH_MM + GAP_MM
_MARKERS_X_MM = (_COLUMNS * _PITCH_MM + GAP_MM + MARKER_MM) / 2.0
_MARKERS_Y_MM = (_ROWS - 1) / 2.0 * _PITCH_MM
_PAGE_MM = (2.0 * _MARKERS_X_MM + MARKER_MM + 6.0, _ROWS * _PITCH_MM + 6.0)
_STEPS = _COLUMNS * _ROWS // 2


def wedge_shares() -> Array:
    """(28,) share of dots that each patch leaves unprinted, by row from the top left.

    Neighbours differ: an error that drifts over the page does not bend the curve.
    """
    # 5 and 14 have no common factor: every step once
    half = np.arange(_STEPS) * 5 % _STEPS / (_STEPS - 1.0)
    return np.concatenate([half, half[::-1]])


def patch_centers_mm() -> Array:
    """(28, 2) centres of the patches from the page's centre, x right, y up, by row from the top left [mm]."""
    x = (np.arange(_COLUMNS) - (_COLUMNS - 1) / 2.0) * _PITCH_MM
    y = ((_ROWS - 1) / 2.0 - np.arange(_ROWS)) * _PITCH_MM
    return np.stack([np.tile(x, _ROWS), np.repeat(y, _COLUMNS)], axis=1)


def marker_corners_mm() -> Array:
    """(4, 4, 2) corners of the fiducials, clockwise from the top left's top left [mm]."""
    half = MARKER_MM / 2.0
    square = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])
    signs = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    return np.asarray((signs * [_MARKERS_X_MM, _MARKERS_Y_MM])[:, None] + square, float)


def marker_ids(dpi: Dpi) -> list[int]:
    """Numbers of the four fiducials of a page of given resolution."""
    first = 4 * RESOLUTIONS.index(dpi)
    return list(range(first, first + 4))


def wedge_dots(dpi: Dpi, tone: ToneCurve | None = None) -> Bilevel:
    """The page's dots, True where nothing is printed.

    Args:
        dpi: the printer's resolution.
        tone: what the dots print as, to check its compensation: the tones then measure as their shares.
    """
    per_mm = dpi / MM_PER_INCH
    columns, rows = (2 * round(side * per_mm / 2.0) for side in _PAGE_MM)
    page = np.ones((rows, columns), bool)

    def place(centre_mm: Array, side_mm: float) -> tuple[slice, slice]:
        side = round(side_mm * per_mm)
        left = round(columns / 2.0 + centre_mm[0] * per_mm - side / 2.0)
        top = round(rows / 2.0 - centre_mm[1] * per_mm - side / 2.0)
        return slice(top, top + side), slice(left, left + side)

    for number, (centre, share) in enumerate(zip(patch_centers_mm(), wedge_shares(), strict=True)):
        where = place(centre, PATCH_MM)
        shape = (where[0].stop - where[0].start, where[1].stop - where[1].start)
        asked = share if tone is None else float(tone.compensated(share))
        page[where] = even_tone(asked, shape, number)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
    for marker, corners in zip(marker_ids(dpi), marker_corners_mm(), strict=True):
        where = place(corners.mean(axis=0), MARKER_MM)
        side = where[0].stop - where[0].start
        page[where] = cv2.aruco.generateImageMarker(dictionary, marker, side) > 127
    return page


def write_wedge_folder(folder: Path, dpi: Dpi, paper: Paper, tone: ToneCurve | None = None) -> Path:
    """Write wedge.pdf into a folder, made if it does not exist; an older one is replaced when the new one is complete.

    Returns:
        Where it is.

    Raises:
        OutputError: the folder or the file cannot be written.
    """
    path = folder / "wedge.pdf"
    if path.is_dir():
        raise OutputError(f"{path}: is a folder, but a file is to be written there; choose another output folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".wedge-", dir=folder) as temporary:
            made = Path(temporary) / path.name
            write_wedge(made, dpi, paper, tone)
            return made.replace(path)
    except OSError as error:
        raise OutputError(
            f"{folder}: the wedge cannot be written there ({error.strerror or error}); choose another folder"
        ) from error


def write_wedge(path: Path, dpi: Dpi, paper: Paper, tone: ToneCurve | None = None) -> None:
    """Write the page.

    Args:
        path: wedge.pdf.
        dpi: the printer's resolution.
        paper: page to print on.
        tone: as in `wedge_dots`.

    Raises:
        OSError: the file cannot be written.
    """
    dots = wedge_dots(dpi, tone)
    dot_mm = MM_PER_INCH / dpi
    where = placement((dots.shape[1] * dot_mm, dots.shape[0] * dot_mm), paper, dot_mm)
    canvas = Canvas(str(path), pagesize=(where.page_mm[0] * mm, where.page_mm[1] * mm), invariant=1)
    canvas.setTitle("arlight probe, tone wedge")
    width, height = where.sheet_mm
    draw_dots(canvas, dots, where.left_mm * mm, where.bottom_mm * mm, width * mm, height * mm)
    canvas.setFont("Helvetica", 5)
    for number, ((x, y), share) in enumerate(zip(patch_centers_mm(), wedge_shares(), strict=True)):
        text_x, text_y = where.left_mm + width / 2.0 + x, where.bottom_mm + height / 2.0 + y - PATCH_MM / 2.0 - 2.6
        canvas.drawCentredString(text_x * mm, text_y * mm, f"{number + 1}: {100.0 * (1.0 - share):.0f} % ink")
    draw_crop_marks(canvas, where)
    draw_crosses(canvas, where)
    draw_ruler(canvas, where)
    corrected = "" if tone is None else ", compensated"
    draw_title(
        canvas,
        where,
        f"TONE WEDGE{corrected}   arlight probe, {dpi} dpi   PRINT AT 100 % ({paper.upper()}, actual size)",
        "Print as the sheet: on its paper, and on the transparency. Photograph from above in even light.",
    )
    canvas.showPage()
    canvas.save()
