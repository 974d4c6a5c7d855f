"""Light relative to its own level: (L_0, L_1/L_0, L_2/L_0, ...), with covariance.

Exposure and white balance scale a channel's coefficients together. What is relative to L_0 does not feel them, so it
can be averaged for long while the level is followed from frame to frame.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.fourier import pack_real, unpack_real

Array = NDArray[np.float64]

_DARKEST = 1e-3
"""Level below which light is not divided by it [radiance * sr]."""


def relative_light(lighting: Lighting) -> tuple[Array, Array]:
    """Level and relative coefficients (c, n) of the channels, real-packed, and their covariance (c, n, n)."""
    packed = pack_real(lighting.coefficients).T
    level = np.maximum(packed[:, :1], _DARKEST)
    values = packed / level
    # d(L_n / L_0) = (dL_n - (L_n / L_0) dL_0) / L_0
    slope = np.tile(np.eye(packed.shape[1]), (len(packed), 1, 1)) / level[:, :, None]
    slope[:, 1:, 0] = -values[:, 1:] / level
    slope[:, 0, 0] = 1.0
    values[:, 0] = packed[:, 0]
    return values, slope @ lighting.covariance @ np.swapaxes(slope, 1, 2)


def absolute_light(values: Array, covariance: Array) -> tuple[NDArray[np.complex128], Array]:
    """Coefficients (k, c) and covariance (c, n, n) of what `relative_light` gives."""
    level = np.maximum(values[:, :1], _DARKEST)
    packed = values * level
    slope = np.tile(np.eye(values.shape[1]), (len(values), 1, 1)) * level[:, :, None]
    slope[:, 1:, 0] = values[:, 1:]
    slope[:, 0, 0] = 1.0
    packed[:, 0] = values[:, 0]
    return unpack_real(packed.T), slope @ covariance @ np.swapaxes(slope, 1, 2)
