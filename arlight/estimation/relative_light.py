"""Light relative to its own level: (L_0, L_1/L_0, L_2/L_0, ...), with variances and the way to its covariance.

Exposure and white balance scale a channel's coefficients together. What is relative to L_0 does not feel them, so it
can be averaged for long while the level is followed from frame to frame. To change between the two forms of a
covariance takes a rank-two update, d(L_n / L_0) = (dL_n - (L_n / L_0) dL_0) / L_0, done wherever the matrix is read.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.native import Workspace, address, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "followed_light")
_LIBRARY.relative_take.argtypes = [ctypes.c_void_p] * 4
_LIBRARY.relative_take.restype = None
_LIBRARY.relative_give.argtypes = [ctypes.c_void_p] * 5
_LIBRARY.relative_give.restype = None
_ARRAYS = ("values", "variance", "scale", "slope", "arm")


class _Shared(Workspace):
    """What relative_light.h calls RelativeLight."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
    )


class RelativeLight:
    """One light at a time in arrays that stay: values (c, n), real-packed, and variance (c, n).

    Args:
        channels, size: number of channels c and of real unknowns n.
    """

    def __init__(self, channels: int, size: int) -> None:
        arrays = dict(zip(_ARRAYS, np.zeros((len(_ARRAYS), channels, size)), strict=True))
        self.values, self.variance = arrays["values"], arrays["variance"]
        self.shared = _Shared(channels, size)
        """The compiled part's view of it."""
        self.shared.hold(arrays)

    def take(self, coefficients: NDArray[np.complex128], covariance: Array, exposure: Array) -> None:
        """Make a light relative to its level, and that to an exposure.

        Args:
            coefficients: (k, c).
            covariance: (c, n, n) real-packed.
            exposure: (c,) what the level is relative to.
        """
        _LIBRARY.relative_take(
            ctypes.byref(self.shared), address(coefficients, np.complex128), address(covariance, np.float64),
            address(exposure, np.float64),
        )  # fmt: skip

    def give(self, exposure: Array, shape: Array) -> tuple[NDArray[np.complex128], Array]:
        """Coefficients (k, c) under an exposure (c,), and their covariance (c, n, n).

        Args:
            exposure: what the level is relative to.
            shape: (c, n, n) covariance of relative light whose correlations are taken; the variances are the light's.
        """
        channels, size = self.values.shape
        coefficients = np.empty(((size + 1) // 2, channels), complex)
        covariance = np.empty((channels, size, size))
        _LIBRARY.relative_give(
            ctypes.byref(self.shared), address(exposure, np.float64), address(shape, np.float64),
            address(coefficients, np.complex128), address(covariance, np.float64),
        )  # fmt: skip
        return coefficients, covariance
