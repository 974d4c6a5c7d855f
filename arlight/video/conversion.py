"""Exact conversion between a frame's planes and R'G'B' or linear light, in floating point.

The decoder library's own RGB conversion rounds dark values down by about a level; radiometry cannot afford it.
"""

from ctypes import byref, c_int32, c_void_p
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from arlight.native import address, library
from arlight.video.curves import IDENTITY, TABLE_SIZE, Curve, decoding_table, encoding_table
from arlight.video.layout import POINTERS, BoxBounds, CurveTable, LayerOfLight, Layout, PictureCodes, layout_of
from arlight.video.pixel_format import LUMA_WEIGHTS, PixelFormat, colour_format

__all__ = [
    "TABLE_SIZE", "Box", "FloatImage", "Plane", "Planes", "Upsampling", "converted", "cover", "decoding_table",
    "encoded_rgb", "encoding_table", "full_range_luma", "linear_luma", "linear_rgb", "with_chroma",
]  # fmt: skip

Upsampling = Literal["guided", "bilinear"]
"""How chroma stored at a lower resolution is brought to every pixel, at its exact position.

`bilinear` interpolates it. `guided` multiplies that by Y' / (Y' averaged as chroma was, then interpolated as chroma
is): exact where the ratios of the channels are locally constant, as on grey stripes under coloured light.
"""
Plane = NDArray[np.uint8] | NDArray[np.uint16]
Planes = tuple[Plane, ...]
Box = tuple[int, int, int, int]
"""x0, y0, x1, y1 of a region, half open [px]."""
FloatImage = NDArray[np.float32]

_LAYOUT, _PICTURE, _BOX, _CURVE = (POINTERS[kind] for kind in (Layout, PictureCodes, BoxBounds, CurveTable))
_colour, _composition = library(__file__, "colour"), library(__file__, "composition")
_resampling = library(__file__, "resampling")
_colour.read_colour.argtypes = [_LAYOUT, _PICTURE, _BOX, c_int32, _CURVE, c_void_p, c_void_p]
_colour.read_luma.argtypes = [_LAYOUT, _PICTURE, _BOX, _CURVE, c_void_p]
_colour.read_bytes.argtypes = [_LAYOUT, _PICTURE, c_int32, c_void_p, c_int32, c_int32, c_void_p, c_void_p]
_composition.cover_picture.argtypes = [
    _LAYOUT, _PICTURE, _PICTURE, POINTERS[LayerOfLight], _BOX, c_void_p, c_void_p,
]  # fmt: skip
_resampling.convert_colour.argtypes = [
    _LAYOUT, _PICTURE, _LAYOUT, _PICTURE, _BOX, c_int32, c_void_p, c_void_p, c_void_p,
]  # fmt: skip
for _function in (
    _colour.read_colour, _colour.read_luma, _colour.read_bytes, _composition.cover_picture, _resampling.convert_colour,
):  # fmt: skip
    _function.restype = None
_READING_LINES = c_int32.in_dll(_colour, "reading_lines").value
_COMPOSING_LINES = c_int32.in_dll(_composition, "composing_lines").value
_RESAMPLING_LINES = c_int32.in_dll(_resampling, "resampling_lines").value
_LINE_MARGIN = c_int32.in_dll(_colour, "line_margin").value


def encoded_rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling = "guided") -> FloatImage:
    """R'G'B' (h, w, 3) of a region, clamped to [0, 1]."""
    return _rgb(planes, format_, box, chroma, IDENTITY)


def linear_rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling = "guided") -> FloatImage:
    """Linear light (h, w, 3) of a region in [0, 1]."""
    return _rgb(planes, format_, box, chroma, decoding_table(format_.transfer))


def linear_luma(planes: Planes, format_: PixelFormat, box: Box) -> FloatImage:
    """Linear light (h, w) in [0, 1] of the encoded luma of a region."""
    table = decoding_table(format_.transfer)
    if format_.matrix == "rgb":
        grey = PixelFormat("gray", True, 8, transfer=format_.transfer)
        return _luma((full_range_luma(planes, format_),), grey, box, table)
    return _luma(planes, format_, box, table)


def full_range_luma(planes: Planes, format_: PixelFormat) -> NDArray[np.uint8]:
    """Encoded luma (h, w) as uint8, 0 black and 255 white; R'G'B' is weighted as BT.709 has it."""
    weights = np.ones(1, np.float32)
    if format_.matrix == "rgb":
        kr, kb = LUMA_WEIGHTS["bt709"]
        weights = np.array([kr, 1.0 - kr - kb, kb], np.float32)
    elif format_.full_range and planes[0].dtype == np.uint8:
        return planes[0].view(np.uint8)
    h, w = planes[0].shape
    out, scratch = np.empty((h, w), np.uint8), np.empty(2 * w, np.float32)
    codes = PictureCodes.of(planes[: len(weights)])
    _colour.read_bytes(
        byref(layout_of((w, h), format_)), byref(codes), len(weights), weights.ctypes.data, w, h, scratch.ctypes.data,
        out.ctypes.data,
    )  # fmt: skip
    return out


def with_chroma(planes: Planes, format_: PixelFormat) -> tuple[Planes, PixelFormat]:
    """Planes that can hold colour: a grey picture gets neutral 4:2:0 chroma, others are left as they are."""
    if format_.matrix != "gray":
        return planes, format_
    h, w = planes[0].shape
    colour = colour_format(format_, (w, h))
    neutral = np.full(colour.chroma_size((w, h))[::-1], colour.chroma_code_range[0], colour.dtype)
    return (planes[0], neutral, neutral), colour


def cover(planes: Planes, format_: PixelFormat, box: Box, over: FloatImage) -> None:
    """Lay light over a region of writable planes, rounded to the nearest codes.

    Args:
        box: the region [px].
        over: light times coverage, and coverage (h, w, 4).
    """
    if min(box[2] - box[0], box[3] - box[1]) == 0:
        return
    around = _with_shared_chroma(box, planes[0].shape, format_)
    before, copies = _codes_before(planes, format_, around)
    scratch = _scratch(around, _COMPOSING_LINES)
    spans = np.empty((around[3] - around[1], 2), np.int32)
    _composition.cover_picture(
        byref(_layout(planes, format_)), byref(before), byref(PictureCodes.of(planes)),
        byref(LayerOfLight(over.ctypes.data, BoxBounds(*box))), byref(BoxBounds(*around)), spans.ctypes.data,
        scratch.ctypes.data,
    )  # fmt: skip
    del copies


def _codes_before(planes: Planes, format_: PixelFormat, box: Box) -> tuple[PictureCodes, Planes]:
    """A copy of what a region's colour is read from, told as if it were all of the picture, and its memory."""
    left, top, right, bottom = _with_shared_chroma(box, planes[0].shape, format_)
    codes, copies = PictureCodes(), []
    for k, plane in enumerate(planes):
        across, down = format_.chroma_shift if k else (0, 0)
        x, y = left >> across, top >> down
        copies.append(plane[y : (bottom >> down) + 1, x : (right >> across) + 1].copy())
        codes.strides[k] = copies[k].strides[0]
        codes.planes[k] = address(copies[k], plane.dtype.type) - y * codes.strides[k] - x * plane.itemsize
    return codes, tuple(copies)


def converted(planes: Planes, format_: PixelFormat, target: PixelFormat) -> Planes:
    """A whole picture's planes in another format of the same transfer, rounded to the nearest codes.

    Args:
        target: a Y'CbCr format; the size stays.
    """
    planes, format_ = with_chroma(planes, format_)
    if format_ == target:
        return planes
    h, w = planes[0].shape
    chroma_shape = target.chroma_size((w, h))[::-1]
    out = tuple(np.empty(shape, target.dtype) for shape in ((h, w), chroma_shape, chroma_shape))
    same = format_.matrix == target.matrix
    matrix = np.eye(3, dtype=np.float32) if same else target.ycc_from_rgb() @ format_.rgb_from_ycc()
    whole, all_pixels = (0, 0, w, h), np.ones(w, np.float32)
    scratch = _scratch(whole, _RESAMPLING_LINES)
    _resampling.convert_colour(
        byref(_layout(planes, format_)), byref(PictureCodes.of(planes)), byref(_layout(out, target)),
        byref(PictureCodes.of(out)), byref(BoxBounds(*whole)), not same, matrix.ctypes.data, all_pixels.ctypes.data,
        scratch.ctypes.data,
    )  # fmt: skip
    return out


def _with_shared_chroma(box: Box, shape: tuple[int, ...], format_: PixelFormat) -> Box:
    """A region with the pixels that share a chroma sample with it: at most a sample and a half on every side."""
    (mx, my), (x0, y0, x1, y1) = (2 << shift for shift in format_.chroma_shift), box
    return max(x0 - mx, 0), max(y0 - my, 0), min(x1 + mx, shape[1]), min(y1 + my, shape[0])


def _rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling, table: Curve) -> FloatImage:
    if format_.matrix == "gray":
        return np.repeat(_luma(planes, format_, box, table)[..., None], 3, axis=2)
    out = np.empty((box[3] - box[1], box[2] - box[0], 3), np.float32)
    if out.size:
        scratch = _scratch(box, _READING_LINES)
        _colour.read_colour(
            byref(_layout(planes, format_)), byref(PictureCodes.of(planes)), byref(BoxBounds(*box)),
            chroma == "guided", byref(CurveTable.of(table)), scratch.ctypes.data, out.ctypes.data,
        )  # fmt: skip
    return out


def _luma(planes: Planes, format_: PixelFormat, box: Box, table: Curve) -> FloatImage:
    out = np.empty((box[3] - box[1], box[2] - box[0]), np.float32)
    _colour.read_luma(
        byref(_layout(planes, format_)), byref(PictureCodes.of(planes[:1])), byref(BoxBounds(*box)),
        byref(CurveTable.of(table)), out.ctypes.data,
    )  # fmt: skip
    return out


def _layout(planes: Planes, format_: PixelFormat) -> Layout:
    h, w = planes[0].shape
    return layout_of((w, h), format_)


def _scratch(box: Box, lines: int) -> FloatImage:
    """Memory that compiled code works in: lines that are a little longer than a region is wide."""
    return np.empty(lines * (box[2] - box[0] + _LINE_MARGIN), np.float32)
