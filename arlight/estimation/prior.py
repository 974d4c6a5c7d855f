"""What is known about natural light before anything is measured."""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.fourier import frequency_order
from arlight.native import address, library

_RELATIVE_SPREAD = 0.35
"""Standard deviation of Re and Im of L~_n relative to L~_0 at order 1, over twelve captured environments."""
COLOR_SPREAD = 0.08
"""The same of the difference between red or blue and green, each relative to its own L~_0."""
_MEAN_SPREAD = 10.0
"""Standard deviation of L~_0: three times a hemisphere of full-scale radiance [radiance * sr]."""
_native = library(__file__, "sheet_estimate")
_native.color_spread.restype = ctypes.c_double
_native.color_spread.argtypes = (
    ctypes.c_int64, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double,
)  # fmt: skip


def prior_stddev(frequencies: NDArray[np.int64], irradiance: float) -> NDArray[np.float64]:
    """Standard deviation (2k - 1,) of the real-packed coefficients about zero.

    Args:
        frequencies: (k, 2), (0, 0) first.
        irradiance: a rough L~_0 of the scene [radiance * sr].
    """
    return _falling(frequencies, _RELATIVE_SPREAD * max(irradiance, 1e-3))


def color_stddev(frequencies: NDArray[np.int64], irradiance: float, spread: float) -> NDArray[np.float64]:
    """Standard deviation (2k - 1,) of red or blue about green's coefficients scaled to its irradiance.

    Args:
        frequencies: (k, 2), (0, 0) first.
        irradiance: the channel's rough L~_0 [radiance * sr].
        spread: relative difference at order 1, `COLOR_SPREAD` until the scene itself has shown how colourful it is.
    """
    return _falling(frequencies, spread * max(irradiance, 1e-3))


def color_spread(
    frequencies: NDArray[np.int64],
    irradiance: float,
    difference: NDArray[np.float64],
    variance: NDArray[np.float64],
    last: float,
) -> float:
    """How colourful a scene's light is: the spread under which the estimated differences are most likely.

    A damped step of MacKay's evidence update, which divides by the number of well-determined differences; repeated
    frame by frame it converges.

    Args:
        frequencies, irradiance: as in `color_stddev`.
        difference: (2k - 1,) estimated red or blue coefficients less green's scaled ones.
        variance: (2k - 1,) of that estimate.
        last: the spread that the estimate was made with.
    """
    unit = color_stddev(frequencies, 1.0, 1.0)
    arrays = [np.array(values, np.float64) for values in (unit, difference, variance)]
    colorful, differences, variances = (address(array, np.float64) for array in arrays)
    return float(_native.color_spread(len(unit), colorful, irradiance, differences, variances, last))


def _falling(frequencies: NDArray[np.int64], first_order: float) -> NDArray[np.float64]:
    # both fall as the square root of the order from 1 to 5
    order = np.repeat(frequency_order(frequencies[1:]), 2)
    return np.concatenate([[_MEAN_SPREAD], first_order / np.sqrt(order)])
