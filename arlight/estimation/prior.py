"""What is known about natural light before anything is measured."""

import numpy as np
from numpy.typing import NDArray

from arlight.fourier import frequency_order

_RELATIVE_SPREAD = 0.35
"""Standard deviation of Re and Im of L~_n relative to L~_0 at order 1, over twelve captured environments."""
_COLOR_SPREAD = 0.08
"""The same of the difference between red or blue and green, each relative to its own L~_0."""
_MEAN_SPREAD = 10.0
"""Standard deviation of L~_0: three times a hemisphere of full-scale radiance [radiance * sr]."""


def prior_stddev(frequencies: NDArray[np.int64], irradiance: float) -> NDArray[np.float64]:
    """Standard deviation (2k - 1,) of the real-packed coefficients about zero.

    Args:
        frequencies: (k, 2), (0, 0) first.
        irradiance: a rough L~_0 of the scene [radiance * sr].
    """
    return _falling(frequencies, _RELATIVE_SPREAD * max(irradiance, 1e-3))


def color_stddev(frequencies: NDArray[np.int64], irradiance: float) -> NDArray[np.float64]:
    """Standard deviation (2k - 1,) of red or blue about green's coefficients scaled to its irradiance."""
    return _falling(frequencies, _COLOR_SPREAD * max(irradiance, 1e-3))


def _falling(frequencies: NDArray[np.int64], first_order: float) -> NDArray[np.float64]:
    # both fall as the square root of the order from 1 to 5
    order = np.repeat(frequency_order(frequencies[1:]), 2)
    return np.concatenate([[_MEAN_SPREAD], first_order / np.sqrt(order)])
