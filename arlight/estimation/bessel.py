"""The Bessel function J_0, which turns what lands around a point into its spectrum."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

_NEAR = (1.0, 0.0, -2.2499997, 0.0, 1.2656208, 0.0, -0.3163866, 0.0, 0.0444479, 0.0, -0.0039444, 0.0, 0.0002100)
_AMPLITUDE = (0.79788456, -0.00000077, -0.00552740, -0.00009512, 0.00137237, -0.00072805, 0.00014476)
_LAG = (-0.78539816, -0.04166397, -0.00003954, 0.00262573, -0.00054125, -0.00029333, 0.00013558)


def bessel_j0(x: ArrayLike) -> NDArray[np.float64]:
    """J_0 of numbers of any shape, 0 or above, to 1e-7.

    Source:
        Abramowitz and Stegun, Handbook of Mathematical Functions, 9.4.1 and 9.4.3.
    """
    value = np.asarray(x, float)
    near = np.polynomial.polynomial.polyval(np.minimum(value, 3.0) / 3.0, _NEAR)
    far = np.maximum(value, 3.0)
    amplitude = np.polynomial.polynomial.polyval(3.0 / far, _AMPLITUDE)
    phase = far + np.polynomial.polynomial.polyval(3.0 / far, _LAG)
    return np.where(value < 3.0, near, amplitude * np.cos(phase) / np.sqrt(far))
