"""Light taken from a picture's pixels, by a share that is known at every 4th of them."""

from ctypes import POINTER, byref, c_float, c_int32, c_void_p

import numpy as np

from arlight.color import POWER_CURVES
from arlight.native import Workspace, address, library
from arlight.video.conversion import Box, FloatImage, Planes, cover, linear_rgb
from arlight.video.layout import POINTERS, BoxBounds, Layout, PictureCodes, layout_of
from arlight.video.pixel_format import PixelFormat

NODE_PX = 4
"""Pixels between two nodes, at which the share is known."""


class _Dimming(Workspace):
    """`struct dimming` of dimming.c."""

    _fields_ = (
        ("left", c_void_p), ("rows", c_int32), ("columns", c_int32), ("box", BoxBounds), ("across", c_int32),
        ("down", c_int32), ("toe", c_float), ("lowered", c_float), ("bend", c_float), ("scratch", c_void_p),
    )  # fmt: skip


_native = library(__file__, "dimming")
_native.dim_picture.restype = None
_native.dim_picture.argtypes = [POINTERS[Layout], POINTERS[PictureCodes], POINTER(_Dimming)]
_SCRATCH = c_int32.in_dll(_native, "dimming_scratch").value


def nodes_of(box: Box) -> tuple[int, int]:
    """(rows, columns) of the nodes of a region: at every 4th pixel from its first, one beyond the last."""
    x0, y0, x1, y1 = box
    return -(-(y1 - y0) // NODE_PX) + 1, -(-(x1 - x0) // NODE_PX) + 1


def node_box(box: Box, size: tuple[int, int]) -> Box:
    """The smallest region around another whose edges are at multiples of 4 pixels, or the edges of the picture."""
    x0, y0, x1, y1 = box
    return (
        x0 // NODE_PX * NODE_PX, y0 // NODE_PX * NODE_PX,
        min(-(-x1 // NODE_PX) * NODE_PX, size[0]), min(-(-y1 // NODE_PX) * NODE_PX, size[1]),
    )  # fmt: skip


def dim(planes: Planes, format_: PixelFormat, box: Box, left: FloatImage) -> None:
    """Take light away from a region of writable planes.

    Args:
        box: the region [px], as `node_box` makes it.
        left: (3, rows, columns) share of red, green and blue linear light that is left at the nodes.
    """
    if min(box[2] - box[0], box[3] - box[1]) == 0:
        return
    if format_.transfer in POWER_CURVES and max(format_.chroma_shift) <= 1:
        _dim_codes(planes, format_, box, left)
        return
    light = linear_rgb(planes, format_, box) * _at_pixels(box, np.clip(np.nan_to_num(left, nan=1.0), 0.0, 1.0))
    cover(planes, format_, box, np.concatenate([light, np.ones_like(light[..., :1])], axis=2))


def _dim_codes(planes: Planes, format_: PixelFormat, box: Box, left: FloatImage) -> None:
    power, lowered, toe = POWER_CURVES[format_.transfer]
    rows, columns = nodes_of(box)
    across, down = (1 << shift for shift in format_.chroma_shift)
    shared = BoxBounds(*box), across, down, toe, lowered, 1.0 / power - 2.0
    dimming = _Dimming(address(left, np.float32), rows, columns, *shared)
    dimming.hold({"scratch": np.empty(_SCRATCH * columns, np.float32)})
    height, width = planes[0].shape
    _native.dim_picture(byref(layout_of((width, height), format_)), byref(PictureCodes.of(planes)), byref(dimming))


def _at_pixels(box: Box, left: FloatImage) -> FloatImage:
    """(h, w, 3) between the nodes."""
    x0, y0, x1, y1 = box
    (row, down), (column, across) = (np.divmod(np.arange(count), NODE_PX) for count in (y1 - y0, x1 - x0))
    part = (down / NODE_PX).astype(np.float32)[:, None]
    lines = left[:, row] + part * (left[:, row + 1] - left[:, row])
    part = (across / NODE_PX).astype(np.float32)
    return np.moveaxis(lines[..., column] + part * (lines[..., column + 1] - lines[..., column]), 0, 2)
