"""Whether the stripes in a frame can be those of the probe's sheet, whatever the light."""

import numpy as np
from numpy.typing import NDArray

from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

_CLEAR_TRANSFER = 0.3
"""Stripes that blur has left above this share can tell one sheet from another."""
_FAINT = 0.01
"""Stripes of this amplitude are as good as none, relative to white."""
_FEWEST, _SMALLEST_SHARE = 4, 0.08
"""How many patterned blocks, and which share of them, must show clear stripes to tell one sheet from another."""


def unexplained_share(means: BlockMeans, channel: int, white: float, predicted: Array, transfer: Array) -> float:
    """Share of the first harmonic that the best fit misses in a typical block.

    On the probe's own sheet noise is left, a few per cent. On a sheet with patterns in other places, of other phases or
    over other glass it is most of the stripes, whatever the light: blocks of one frequency contradict each other.

    Args:
        means: the frame's measurements.
        channel: 0, 1, 2 for red, green, blue.
        white: radiance of clear film on white paper.
        predicted: (blocks, 7) rows that the fit predicts.
        transfer: (blocks, 7) what blur leaves of each row.

    Returns:
        The median over blocks of |missed| / (|measured| + what is as good as none); nan where too few blocks show
        clear stripes, as on a sheet that is small in the picture.
    """
    patterned = np.any(means.cycles_per_px != 0.0, axis=1)
    clear = patterned & means.valid & (means.harmonics >= 1) & (transfer[:, 1] > _CLEAR_TRANSFER)
    if np.count_nonzero(clear) < max(_FEWEST, _SMALLEST_SHARE * np.count_nonzero(patterned)):
        return float("nan")
    measured = means.values[clear, 1:3, channel]
    missed = np.linalg.norm(measured - predicted[clear, 1:3], axis=1)
    return float(np.median(missed / (np.linalg.norm(measured, axis=1) + _FAINT * white)))
