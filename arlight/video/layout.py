"""What compiled code is told of a picture: its format, made once and kept, and where its codes are."""

from collections.abc import Sequence
from ctypes import POINTER, Structure, c_float, c_int32, c_int64, c_void_p
from functools import lru_cache
from typing import Any

from numpy.typing import NDArray

from arlight.native import Workspace
from arlight.video.chroma_grid import AxisGrid, axis_grid
from arlight.video.curves import Curve, decoding_table, encoding_table
from arlight.video.pixel_format import PixelFormat


class _Axis(Structure):
    """`struct axis` of picture.h."""

    _fields_ = (
        ("taps", c_int32), ("samples", c_int32), ("share", c_int32), ("inner_pixels", c_int32 * 2),
        ("inner_samples", c_int32 * 2), ("lower", c_void_p), ("upper", c_void_p), ("weight", c_void_p),
        ("tapped", c_void_p), ("tap_weights", c_void_p),
    )  # fmt: skip

    @classmethod
    def of(cls, grid: AxisGrid) -> "_Axis":
        arrays = (grid.lower, grid.upper, grid.weight, grid.taps, grid.tap_weights)
        inner = (grid.inner_pixels, grid.inner_samples)
        return cls(*grid.taps.shape, grid.share, *inner, *(array.ctypes.data for array in arrays))


class CurveTable(Structure):
    """`struct curve` of picture.h; the array is the caller's to keep."""

    _fields_ = (("values", c_void_p), ("last", c_float))

    @classmethod
    def of(cls, curve: Curve) -> "CurveTable":
        """A curve's table."""
        return cls(curve.ctypes.data, len(curve) - 2)


class Layout(Workspace):
    """`struct layout` of picture.h: what the codes of pictures of one size and format stand for."""

    _fields_ = (
        ("wide", c_int32), ("subsampled", c_int32), ("black", c_float), ("luma_span", c_float), ("neutral", c_float),
        ("chroma_span", c_float), ("top", c_float), ("columns", _Axis), ("rows", _Axis), ("rgb_from_ycc", c_void_p),
        ("ycc_from_rgb", c_void_p), ("decode", CurveTable), ("encode", CurveTable),
    )  # fmt: skip


class PictureCodes(Structure):
    """`struct picture` of picture.h: where the planes are."""

    _fields_ = (("planes", c_void_p * 3), ("strides", c_int64 * 3))

    @classmethod
    def of(cls, planes: Sequence[NDArray[Any]]) -> "PictureCodes":
        """Planes whose rows are contiguous; they are the caller's to keep."""
        codes = cls()
        for k, plane in enumerate(planes):
            codes.planes[k], codes.strides[k] = plane.ctypes.data, plane.strides[0]
        return codes


class BoxBounds(Structure):
    """`struct box` of picture.h."""

    _fields_ = (("x0", c_int32), ("y0", c_int32), ("x1", c_int32), ("y1", c_int32))


class LayerOfLight(Structure):
    """`struct layer` of composition.c: new light of a region."""

    _fields_ = (("over", c_void_p), ("box", BoxBounds))


POINTERS = {kind: POINTER(kind) for kind in (Layout, PictureCodes, BoxBounds, CurveTable, LayerOfLight)}


@lru_cache(maxsize=16)
def layout_of(size: tuple[int, int], format_: PixelFormat) -> Layout:
    """The layout of pictures of `size` (w, h) [px]; planes R, G, B are read as Y', Cb, Cr with an identity matrix."""
    layout = Layout()
    black, span = format_.luma_code_range
    colour = (black, span) if format_.matrix in ("rgb", "gray") else format_.chroma_code_range
    layout.wide, layout.subsampled = format_.bit_depth > 8, format_.chroma_shift != (0, 0)
    layout.black, layout.luma_span, layout.neutral, layout.chroma_span = black, span, *colour
    layout.top = 2**format_.bit_depth - 1
    (sx, sy), (ox, oy) = format_.chroma_shift, format_.chroma_offset_px
    columns, rows = axis_grid(size[0], sx, ox), axis_grid(size[1], sy, oy)
    layout.columns, layout.rows = _Axis.of(columns), _Axis.of(rows)
    decode, encode = decoding_table(format_.transfer), encoding_table(format_.transfer)
    layout.decode, layout.encode = CurveTable.of(decode), CurveTable.of(encode)
    layout.hold({"rgb_from_ycc": format_.rgb_from_ycc(), "ycc_from_rgb": format_.ycc_from_rgb()})
    layout.kept = (columns, rows, decode, encode)
    return layout
