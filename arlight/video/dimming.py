"""Light taken from a picture's pixels, by a share that is known at every 4th of them."""

from ctypes import POINTER, byref, c_float, c_int32, c_void_p

import numpy as np

from arlight.color import POWER_CURVES
from arlight.native import Workspace, address, library
from arlight.video.conversion import Box, FloatImage, Planes, linear_rgb
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


def is_direct(format_: PixelFormat) -> bool:
    """Whether pictures of a format can be dimmed without bringing them to linear light."""
    return format_.transfer in POWER_CURVES and max(format_.chroma_shift) <= 1 and format_.plane_count == 3


def dim(planes: Planes, format_: PixelFormat, box: Box, left: FloatImage) -> None:
    """Dim a region of a picture in place.

    Args:
        planes: writable, of a format that `is_direct`.
        box: the region [px], as `node_box` makes it.
        left: (3, rows, columns) share of red, green and blue light that is left at the nodes.
    """
    power, lowered, toe = POWER_CURVES[format_.transfer]
    rows, columns = nodes_of(box)
    across, down = (1 << shift for shift in format_.chroma_shift)
    bounds = BoxBounds(*box)
    dimming = _Dimming(address(left, np.float32), rows, columns, bounds, across, down, toe, lowered, 1.0 / power - 2.0)
    dimming.hold({"scratch": np.empty(_SCRATCH * columns, np.float32)})
    height, width = planes[0].shape
    _native.dim_picture(byref(layout_of((width, height), format_)), byref(PictureCodes.of(planes)), byref(dimming))


def dimmed_light(planes: Planes, format_: PixelFormat, box: Box, left: FloatImage) -> FloatImage:
    """Linear light (h, w, 3) of a region times what is left of it, for any format."""
    share = np.clip(np.nan_to_num(left, nan=1.0), 0.0, 1.0)
    x0, y0, x1, y1 = box
    for axis, count in ((1, y1 - y0), (2, x1 - x0)):
        node, part = np.divmod(np.arange(count), NODE_PX)
        weight = (part / np.float32(NODE_PX)).reshape((-1, 1) if axis == 1 else -1)
        before, after = share.take(node, axis), share.take(node + 1, axis)
        share = before + weight.astype(np.float32) * (after - before)
    return linear_rgb(planes, format_, box) * np.moveaxis(share, 0, 2)
