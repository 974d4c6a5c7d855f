"""What `arlight table` takes."""

from dataclasses import dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class TableOptions:
    """Measure the error per order at several camera tilts and sheet widths, on synthesised footage.

    Errors are relative to |L_0|, medians over the frames after the first ten: filtered, of single frames, and the least
    that any unbiased estimate of a single frame could have (Cramer-Rao). Frames are 8-bit sRGB, not compressed.
    """

    order: int = 5
    """Order of the sheet, 1 to 8."""
    environment: Annotated[str, tyro.conf.arg(metavar="NAME|FILE")] = "hall"
    """Captured light: the name of one that comes with arlight, or a latitude-longitude .hdr or .exr file."""
    tilts_deg: tuple[float, ...] = (15.0, 35.0, 55.0, 70.0)
    """Camera's angles off the sheet's normal [deg]."""
    widths_px: tuple[float, ...] = (300.0, 450.0, 700.0)
    """Widths of the sheet in the picture [px]."""
    frames: int = 16
    """Frames of each clip."""
