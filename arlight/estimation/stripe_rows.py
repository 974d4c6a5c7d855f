"""Rows of a block: its mean, then cosine and sine of each harmonic of its stripes."""

import numpy as np
from numpy.typing import NDArray

from arlight.tracking.block_means import HARMONICS, BlockMeans

Array = NDArray[np.float64]

HARMONIC_OF_ROW = np.concatenate([[0], np.repeat(np.arange(1, HARMONICS + 1), 2)])
"""(7,) which harmonic each row tells of; 0 for the mean."""
WEAKEST_TRANSFER = 0.12
"""Harmonics that blur has taken below this share are not used."""


def turned_rows(rows: Array, lead_rad: Array) -> Array:
    """Rows (blocks, 7, ...) of stripes that lie ahead by a phase (blocks,) of the phase they are told in [rad]."""
    turn = np.exp(1j * np.multiply.outer(lead_rad, np.arange(1, HARMONICS + 1)))
    series = (rows[:, 1::2] - 1j * rows[:, 2::2]) * turn.reshape(turn.shape + (1,) * (rows.ndim - 2))
    turned = rows.copy()
    turned[:, 1::2], turned[:, 2::2] = series.real, -series.imag
    return turned


def usable_rows(means: BlockMeans, transfer: Array) -> NDArray[np.bool_]:
    """(blocks, 7) rows that were measured and of which blur leaves enough.

    Args:
        transfer: (blocks, 7) what blur leaves.
    """
    usable = (means.harmonics[:, None] >= HARMONIC_OF_ROW) & (transfer > WEAKEST_TRANSFER)
    # a mean is there whatever the stripes are
    usable[:, 0] = True
    return usable & means.valid[:, None]
