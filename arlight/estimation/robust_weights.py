"""How much a block counts whose stripes stray: what hides a part of it spoils all its harmonics together.

A stray mean is a mirrored lamp's, which has an unknown of its own (`lamps`), so weights judge the harmonics.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FREEDOM = 8.0
"""Degrees of freedom of the Student-t distribution of a block's harmonics."""


def block_weights(squared: Array, usable: NDArray[np.bool_], freedom: float = FREEDOM) -> Array:
    """Student-t weight (blocks,) by all harmonics of a block together.

    Args:
        squared: (blocks, 7) residuals, squared, relative to their variances.
        usable: (blocks, 7) rows that count.
        freedom: degrees of freedom; the fewer, the less a stray block counts.

    Source: Lange, Little, Taylor, "Robust statistical modeling using the t distribution", 1989.
    """
    total, count = harmonic_squares(squared, usable)
    return (freedom + count) / (freedom + total)


def harmonic_squares(squared: Array, usable: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Sum (blocks,) of the usable harmonics' squared residuals (blocks, 7), and how many they are (blocks,)."""
    harmonics = usable[:, 1:]
    return np.sum(np.where(harmonics, squared[:, 1:], 0.0), axis=1), np.sum(harmonics, axis=1)
