"""Where chroma samples lie on the luma grid, and the filters that lead there and back along one axis."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class AxisGrid(NamedTuple):
    """One axis of a picture: how its pixels read chroma, and how its chroma samples average pixels.

    Down: a box as wide as a chroma sample's share of the picture, centred on the sample (so 1 2 1 where chroma lies on
    a luma column, 1 1 where it lies between two). Up: linear interpolation. Both repeat the picture's edge.
    """

    lower: NDArray[np.int32]
    """For each pixel, the chroma sample before it."""
    upper: NDArray[np.int32]
    """For each pixel, the chroma sample after it."""
    weight: NDArray[np.float32]
    """For each pixel, the weight of `upper`."""
    taps: NDArray[np.int32]
    """(taps, samples) the pixels that each chroma sample averages, in ascending order."""
    tap_weights: NDArray[np.float32]
    """Their weights (taps,), which sum to 1."""
    share: int
    """Pixels to a chroma sample."""
    inner_pixels: tuple[int, int]
    """First and end of the pixels that read as many samples on as they lie shares on: no edge is near."""
    inner_samples: tuple[int, int]
    """First and end of the samples that average pixels as many shares on as they lie samples on."""


@lru_cache(maxsize=16)
def axis_grid(length: int, shift: int, offset_px: float) -> AxisGrid:
    """The grid of an axis of `length` pixels.

    Args:
        shift: log2 of the pixels that share a chroma sample.
        offset_px: position of chroma sample 0 [px].
    """
    share, samples = 1 << shift, ((length - 1) >> shift) + 1
    position = (np.arange(length) - offset_px) / share
    before = np.floor(position).astype(np.int32)
    lower, upper = np.clip(before, 0, samples - 1), np.clip(before + 1, 0, samples - 1)
    inner_pixels = _first_and_end((before >= 0) & (before + 1 < samples))
    reach = np.arange(-share, share + 1) + np.floor(offset_px)
    overlap = np.minimum(reach + 0.5, offset_px + share / 2) - np.maximum(reach - 0.5, offset_px - share / 2)
    reach, overlap = reach[overlap > 0], overlap[overlap > 0]
    taps = (reach[:, None] + np.arange(samples) * share).astype(np.int32)
    inner_samples = _first_and_end(np.all((taps >= 0) & (taps < length), axis=0))
    weight, tap_weights = (position - before).astype(np.float32), (overlap / share).astype(np.float32)
    taps = np.clip(taps, 0, length - 1)
    return AxisGrid(lower, upper, weight, taps, tap_weights, share, inner_pixels, inner_samples)


def _first_and_end(marked: NDArray[np.bool_]) -> tuple[int, int]:
    """Of a run of marks without a gap."""
    places = np.flatnonzero(marked)
    return (int(places[0]), int(places[-1]) + 1) if len(places) else (0, 0)
