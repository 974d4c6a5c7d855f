"""Turns the planes of a picture upright, as a phone's display rotation asks."""

from dataclasses import replace

import numpy as np

from arlight.video.conversion import Planes
from arlight.video.pixel_format import PixelFormat


def upright(planes: Planes, format_: PixelFormat, rotation_deg: float) -> tuple[Planes, PixelFormat]:
    """A picture turned for display, its chroma sites with it.

    Args:
        planes: (Y, Cb, Cr), (R, G, B) or one grey plane, as stored.
        rotation_deg: angle to turn the picture by, counter-clockwise; taken to the nearest quarter turn.

    Returns:
        The planes, views where possible, and their format: 4:2:2 may become 4:4:0.
    """
    for _ in range(round(rotation_deg / 90.0) % 4):
        format_ = _turned(format_, width_px=planes[0].shape[1])
        planes = tuple(np.rot90(p) for p in planes)
    return planes, format_


def _turned(format_: PixelFormat, width_px: int) -> PixelFormat:
    """The format of a picture of `width_px` after a quarter turn counter-clockwise: x' = y, y' = width - 1 - x."""
    (sx, sy), (ox, oy) = format_.chroma_shift, format_.chroma_offset_px
    last_chroma = (width_px - 1) >> sx
    return replace(
        format_, chroma_shift=(sy, sx), chroma_offset_px=(oy, float(width_px - 1 - ((last_chroma << sx) + ox)))
    )
