"""Where chroma samples lie on the luma grid, and the filters that lead there and back along one axis."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class AxisGrid(NamedTuple):
    """One axis of a region: how its pixels read chroma, and how its chroma samples average pixels.

    Down: a box as wide as a chroma sample's share of the picture, centred on the sample (so 1 2 1 where chroma lies on
    a luma column, 1 1 where it lies between two). Up: linear interpolation. Both repeat the picture's edge.
    """

    start: int
    """First pixel."""
    chroma_start: int
    """First chroma sample that the region's pixels read."""
    chroma_count: int
    """How many they read, without a gap."""
    lower: NDArray[np.int32]
    """For each pixel, the chroma sample before it, relative to `chroma_start`."""
    upper: NDArray[np.int32]
    """For each pixel, the chroma sample after it."""
    weight: NDArray[np.float32]
    """For each pixel, the weight of `upper`."""
    taps: NDArray[np.int32]
    """For each chroma sample (count, taps), the pixels it averages, in the picture."""
    tap_weights: NDArray[np.float32]
    """Their weights (taps,), which sum to 1."""


@lru_cache(maxsize=64)
def axis_grid(length: int, start: int, stop: int, shift: int, offset_px: float) -> AxisGrid:
    """The grid of the pixels start <= x < stop of an axis of `length` pixels.

    Args:
        shift: log2 of the pixels that share a chroma sample.
        offset_px: position of chroma sample 0 [px].
    """
    share, last = 1 << shift, (length - 1) >> shift
    position = (np.arange(start, stop) - offset_px) / share
    before = np.floor(position).astype(np.int32)
    lower, upper = np.clip(before, 0, last), np.clip(before + 1, 0, last)
    first = int(lower.min(initial=last))
    count = int(upper.max(initial=first)) - first + 1
    reach = np.arange(-share, share + 1) + np.floor(offset_px)
    overlap = np.minimum(reach + 0.5, offset_px + share / 2) - np.maximum(reach - 0.5, offset_px - share / 2)
    reach, overlap = reach[overlap > 0], overlap[overlap > 0]
    taps = np.clip((first + np.arange(count))[:, None] * share + reach, 0, length - 1).astype(np.int32)
    return AxisGrid(
        start, first, count, (lower - first).astype(np.int32), (upper - first).astype(np.int32),
        (position - before).astype(np.float32), taps, (overlap / share).astype(np.float32),
    )  # fmt: skip
