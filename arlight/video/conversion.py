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
from arlight.video.pixel_format import HD_LINES, PixelFormat, chroma_offset_px

Upsampling = Literal["guided", "bilinear"]
"""How chroma stored at a lower resolution is brought to every pixel, at its exact position.

`bilinear` interpolates it. `guided` multiplies that by Y' / (Y' averaged as chroma was, interpolated as chroma is): exact
where the colour's ratios are locally constant, as with grey stripes under coloured light.
"""
Planes = tuple[NDArray[np.uint8] | NDArray[np.uint16], ...]
Box = tuple[int, int, int, int]
"""x0, y0, x1, y1 of a region, half open [px]."""
FloatImage = NDArray[np.float32]

TABLE_SIZE = 4097
"""Entries of a transfer curve's table; linear interpolation in it is good to 2e-7 of full scale."""


@cache
def decoding_table(transfer: Transfer) -> FloatImage:
    """Linear light over encoded values in [0, 1], evenly spaced."""
    return linear_from_encoded(np.linspace(0.0, 1.0, TABLE_SIZE), transfer)


@cache
def encoding_table(transfer: Transfer) -> FloatImage:
    """Encoded values over the SQUARE ROOT of linear light in [0, 1], where every curve is smooth enough for a table."""
    return encoded_from_linear(np.linspace(0.0, 1.0, TABLE_SIZE) ** 2, transfer)


IDENTITY = np.array([0.0, 1.0], np.float32)
"""The table that only clamps."""


def encoded_rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling = "guided") -> FloatImage:
    """R'G'B' (h, w, 3) of a region, clamped to [0, 1]."""
    return _rgb(planes, format_, box, chroma, IDENTITY)


def linear_rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling = "guided") -> FloatImage:
    """Linear light (h, w, 3) of a region in [0, 1]."""
    return _rgb(planes, format_, box, chroma, decoding_table(format_.transfer))


def linear_luma(planes: Planes, format_: PixelFormat, box: Box) -> FloatImage:
    """Linear light (h, w) of the encoded luma of a region."""
    table = decoding_table(format_.transfer)
    if format_.matrix == "rgb":
        return kernels.scaled(luma_of_rgb(planes, format_), *box, np.float32(0), np.float32(1 / 255), table)
    return kernels.scaled(planes[0], *box, *_luma_scale(format_), table)


def luma_of_rgb(planes: Planes, format_: PixelFormat) -> NDArray[np.uint8]:
    """Encoded luma (h, w) of R'G'B' planes with the weights of BT.709."""
    black, scale = _luma_scale(format_)
    red, green, blue = (p.astype(np.float32) for p in planes)
    luma = (0.2126 * red + 0.7152 * green + 0.0722 * blue - black) * (scale * 255.0) + 0.5
    return np.clip(luma, 0.0, 255.0).astype(np.uint8)


def full_range_luma(plane: NDArray[np.uint8] | NDArray[np.uint16], format_: PixelFormat) -> NDArray[np.uint8]:
    """Luma codes brought to uint8, 0 black and 255 white."""
    return kernels.quantised(plane, *_luma_scale(format_))


def with_chroma(planes: Planes, format_: PixelFormat) -> tuple[Planes, PixelFormat]:
    """Planes that can hold colour: a grey picture gets neutral 4:2:0 chroma, others are left as they are."""
    if format_.matrix != "gray":
        return planes, format_
    h, w = planes[0].shape
    colour = PixelFormat(
        "bt709" if min(w, h) >= HD_LINES else "bt601", format_.full_range, format_.bit_depth, (1, 1), chroma_offset_px("left", (1, 1)),
        format_.transfer,
    )  # fmt: skip
    neutral = np.full(colour.chroma_size((w, h))[::-1], colour.chroma_code_range[0], colour.dtype)
    return (planes[0], neutral, neutral), colour


def replaced(planes: Planes, format_: PixelFormat, box: Box, linear: FloatImage) -> Planes:
    """Planes with the linear light (h, w, 3) of a region replaced, rounded to the nearest codes."""
    h, w = planes[0].shape
    # the pixels that share a chroma sample with the region: a chroma sample and half, rounded up, on every side
    margin = [(2 << shift) for shift in format_.chroma_shift]
    x0, y0, x1, y1 = box
    outer = (max(x0 - margin[0], 0), max(y0 - margin[1], 0), min(x1 + margin[0], w), min(y1 + margin[1], h))
    own = _full_resolution(planes, format_, outer, "guided")
    new = own.copy()
    changed = kernels.replace_pixels(
        new, x0 - outer[0], y0 - outer[1], linear, format_.rgb_from_ycc(), format_.ycc_from_rgb(),
        decoding_table(format_.transfer), encoding_table(format_.transfer),
    )  # fmt: skip
    out = tuple(p.copy() for p in planes)
    black, white = np.float32(format_.luma_code_range)
    neutral, span = np.float32(format_.chroma_code_range)
    top = np.float32(2**format_.bit_depth - 1)
    kernels.write_plane(out[0], outer[0], outer[1], new[..., 0], changed, black, white, top)
    columns, rows = _grids(planes[0].shape, format_, outer)
    for k in (1, 2):
        if format_.matrix == "rgb":
            kernels.write_plane(out[k], outer[0], outer[1], new[..., k], changed, black, white, top)
        else:
            kernels.write_chroma(
                out[k], own[..., k], new[..., k], changed, outer[0], outer[1], columns, rows, neutral, span, top
            )
    return out


def _rgb(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling, table: FloatImage) -> FloatImage:
    if format_.matrix == "gray":
        return np.repeat(kernels.scaled(planes[0], *box, *_luma_scale(format_), table)[..., None], 3, axis=2)
    image = _full_resolution(planes, format_, box, chroma)
    kernels.to_rgb(image, format_.rgb_from_ycc(), table)
    return image


def _full_resolution(planes: Planes, format_: PixelFormat, box: Box, chroma: Upsampling) -> FloatImage:
    """Y', Cb, Cr (or R', G', B') at every pixel of a region (h, w, 3), not clamped."""
    black, scale = _luma_scale(format_)
    if format_.matrix == "rgb":
        x0, y0, x1, y1 = box
        return np.stack([(p[y0:y1, x0:x1].astype(np.float32) - black) * scale for p in planes], axis=2)
    columns, rows = _grids(planes[0].shape, format_, box)
    guided = chroma == "guided" and format_.chroma_shift != (0, 0)
    luma_low = np.zeros((1, 1), np.float32)
    if guided:
        luma_low = kernels.chroma_means(
            planes[0], black, scale, columns.taps, columns.tap_weights, rows.taps, rows.tap_weights
        )
    neutral, span = format_.chroma_code_range
    return kernels.full_resolution(
        *planes, black, scale, np.float32(neutral), np.float32(1.0 / span), luma_low, guided, columns, rows
    )


def _grids(shape: tuple[int, ...], format_: PixelFormat, box: Box) -> tuple[AxisGrid, AxisGrid]:
    (sx, sy), (ox, oy) = format_.chroma_shift, format_.chroma_offset_px
    return axis_grid(shape[1], box[0], box[2], sx, ox), axis_grid(shape[0], box[1], box[3], sy, oy)


def _luma_scale(format_: PixelFormat) -> tuple[np.float32, np.float32]:
    black, span = format_.luma_code_range
    return np.float32(black), np.float32(1.0 / span)
