"""Exact conversion between a frame's planes and R'G'B' or linear light, in floating point.

The decoder library's own RGB conversion rounds dark values down by about a level; radiometry cannot afford it.
"""

from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from arlight.color import Transfer, encoded_from_linear, linear_from_encoded
from arlight.video import kernels
from arlight.video.chroma_grid import AxisGrid, axis_grid
from arlight.video.pixel_format import LUMA_WEIGHTS, PixelFormat, colour_format

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

TABLE_SIZE = 4097
"""Samples of a transfer curve over [0, 1]; linear interpolation between them is good to 1e-6 of full scale."""
IDENTITY = np.array([0.0, 1.0, 1.0], np.float32)
"""The table that only clamps."""


@cache
def decoding_table(transfer: Transfer) -> FloatImage:
    """Linear light over encoded values in [0, 1]; the last entry stands twice (see `kernels`)."""
    table = linear_from_encoded(np.linspace(0.0, 1.0, TABLE_SIZE), transfer)
    return np.append(table, table[-1:])


@cache
def encoding_table(transfer: Transfer) -> FloatImage:
    """Encoded values over the SQUARE ROOT of linear light, where every curve is smooth; the last entry stands twice."""
    table = encoded_from_linear(np.linspace(0.0, 1.0, TABLE_SIZE) ** 2, transfer)
    return np.append(table, table[-1:])


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
        white = (np.float32(0.0), np.float32(1.0 / 255.0))
        return kernels.through_table(full_range_luma(planes, format_), *box, *white, table)
    return kernels.through_table(planes[0], *box, *_luma_scale(format_), table)


def full_range_luma(planes: Planes, format_: PixelFormat) -> NDArray[np.uint8]:
    """Encoded luma (h, w) as uint8, 0 black and 255 white; R'G'B' is weighted as BT.709 has it."""
    if format_.matrix == "rgb":
        kr, kb = LUMA_WEIGHTS["bt709"]
        weights = (np.float32(kr), np.float32(1.0 - kr - kb), np.float32(kb))
        red, green, blue = planes
        return kernels.weighted_bytes(red, green, blue, weights, *_luma_scale(format_))
    if format_.full_range and planes[0].dtype == np.uint8:
        return planes[0].view(np.uint8)
    return kernels.to_bytes(planes[0], *_luma_scale(format_))


def with_chroma(planes: Planes, format_: PixelFormat) -> tuple[Planes, PixelFormat]:
    """Planes that can hold colour: a grey picture gets neutral 4:2:0 chroma, others are left as they are."""
    if format_.matrix != "gray":
        return planes, format_
    h, w = planes[0].shape
    colour = colour_format(format_, (w, h))
    neutral = np.full(colour.chroma_size((w, h))[::-1], colour.chroma_code_range[0], colour.dtype)
    return (planes[0], neutral, neutral), colour


def replaced(planes: Planes, format_: PixelFormat, box: Box, linear: FloatImage) -> Planes:
    """Planes with the linear light (h, w, 3) of a region replaced where it differs, rounded to the nearest codes."""
    outer = _with_shared_chroma(box, planes[0].shape, format_)
    own = _full_resolution(planes, format_, outer, "guided")
    new = own.copy()
    changed = kernels.replace_pixels(
        new, box[0] - outer[0], box[1] - outer[1], linear, format_.rgb_from_ycc(), format_.ycc_from_rgb(),
        decoding_table(format_.transfer), encoding_table(format_.transfer),
    )  # fmt: skip
    out = tuple(plane.copy() for plane in planes)
    luma, chroma = _code_scales(format_)
    kernels.write_plane(out[0], outer[0], outer[1], new, 0, changed, *luma)
    columns, rows = _grids(planes[0].shape, format_, outer)
    for k in (1, 2):
        if format_.matrix == "rgb":
            kernels.write_plane(out[k], outer[0], outer[1], new, k, changed, *luma)
        else:
            kernels.write_chroma(out[k], own, new, k, changed, outer[0], outer[1], columns, rows, *chroma)
    return out


def converted(planes: Planes, format_: PixelFormat, target: PixelFormat) -> Planes:
    """A whole picture's planes in another format of the same transfer, rounded to the nearest codes.

    Args:
        target: a Y'CbCr format; the size stays.
    """
    planes, format_ = with_chroma(planes, format_)
    if format_ == target:
        return planes
    h, w = planes[0].shape
    whole = (0, 0, w, h)
    image = _full_resolution(planes, format_, whole, "bilinear" if format_.matrix == target.matrix else "guided")
    if format_.matrix != target.matrix:
        kernels.recombine(image, target.ycc_from_rgb() @ format_.rgb_from_ycc())
    luma, chroma = _code_scales(target)
    chroma_shape = target.chroma_size((w, h))[::-1]
    out = tuple(np.empty(shape, target.dtype) for shape in ((h, w), chroma_shape, chroma_shape))
    kernels.write_plane(out[0], 0, 0, image, 0, np.ones((h, w), np.uint8), *luma)
    columns, rows = _grids((h, w), target, whole)
    for k in (1, 2):
        taps = (columns.taps, columns.tap_weights, rows.taps, rows.tap_weights)
        kernels.average_chroma(image, k, *taps, out[k], *chroma)
    return out


def _with_shared_chroma(box: Box, shape: tuple[int, ...], format_: PixelFormat) -> Box:
    """A region with the pixels that share a chroma sample with it: at most a sample and a half on every side."""
    (mx, my), (x0, y0, x1, y1) = (2 << shift for shift in format_.chroma_shift), box
    return max(x0 - mx, 0), max(y0 - my, 0), min(x1 + mx, shape[1]), min(y1 + my, shape[0])


def _rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling, table: FloatImage) -> FloatImage:
    if format_.matrix == "gray":
        grey = kernels.through_table(planes[0], *box, *_luma_scale(format_), table)
        return np.repeat(grey[..., None], 3, axis=2)
    image = _full_resolution(planes, format_, box, chroma)
    kernels.to_rgb(image, format_.rgb_from_ycc(), table)
    return image


def _full_resolution(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling) -> FloatImage:
    """Y', Cb, Cr (or R', G', B') at every pixel of a region (h, w, 3), not clamped."""
    black, scale = _luma_scale(format_)
    if format_.matrix == "rgb":
        red, green, blue = planes
        return kernels.stack(red, green, blue, *box, black, scale)
    columns, rows = _grids(planes[0].shape, format_, box)
    guided = chroma == "guided" and format_.chroma_shift != (0, 0)
    luma_low = np.zeros((1, 1), np.float32)
    if guided:
        taps = (columns.taps, columns.tap_weights, rows.taps, rows.tap_weights)
        luma_low = kernels.chroma_means(planes[0], black, scale, *taps)
    neutral, span = format_.chroma_code_range
    chroma_scale = (np.float32(neutral), np.float32(1.0 / span))
    luma, cb, cr = planes
    return kernels.full_resolution(luma, cb, cr, black, scale, *chroma_scale, luma_low, guided, columns, rows)


def _grids(shape: tuple[int, ...], format_: PixelFormat, box: Box) -> tuple[AxisGrid, AxisGrid]:
    (sx, sy), (ox, oy) = format_.chroma_shift, format_.chroma_offset_px
    return axis_grid(shape[1], box[0], box[2], sx, ox), axis_grid(shape[0], box[1], box[3], sy, oy)


def _luma_scale(format_: PixelFormat) -> tuple[np.float32, np.float32]:
    """Code of black and values per code."""
    black, span = format_.luma_code_range
    return np.float32(black), np.float32(1.0 / span)


def _code_scales(format_: PixelFormat) -> list[tuple[np.float32, np.float32, np.float32]]:
    """Code of 0, codes per unit and highest code, for luma and for chroma."""
    top = np.float32(2**format_.bit_depth - 1)
    ranges = (format_.luma_code_range, format_.chroma_code_range)
    return [(np.float32(zero), np.float32(span), top) for zero, span in ranges]
