"""Light relative to its own level: (L_0, L_1/L_0, L_2/L_0, ...), with variances and the way to its covariance.

Exposure and white balance scale a channel's coefficients together. What is relative to L_0 does not feel them, so it
can be averaged for long while the level is followed from frame to frame. To change between the two forms of a
covariance takes a rank-two update, d(L_n / L_0) = (dL_n - (L_n / L_0) dL_0) / L_0, done wherever the matrix is read.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.native import Workspace, address, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "relative_light")
_LIBRARY.take.argtypes = [ctypes.c_void_p] * 4
_LIBRARY.give.argtypes = [ctypes.c_void_p] * 5


class _Workspace(Workspace):
    """What relative_light.c calls RelativeLight."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        ("values", ctypes.c_void_p),
        ("variance", ctypes.c_void_p),
        ("scale", ctypes.c_void_p),
        ("slope", ctypes.c_void_p),
        ("arm", ctypes.c_void_p),
    )


class RelativeLight:
    """One light at a time in arrays that stay: values (c, n), real-packed, and variance (c, n).

    scale, slope, arm (c, n) are the terms in which its covariance is read: entry (i, j) becomes
    scale_i scale_j M_ij + slope_i arm_j + slope_j arm_i.

    Args:
        channels, size: number of channels c and of real unknowns n.
    """

    def __init__(self, channels: int, size: int) -> None:
        self.values, self.variance, self.scale, self.slope, self.arm = np.zeros((5, channels, size))
        self._workspace = _Workspace(channels, size)
        self._workspace.hold(
            {
                "values": self.values,
                "variance": self.variance,
                "scale": self.scale,
                "slope": self.slope,
                "arm": self.arm,
            }
        )
        self._at = ctypes.byref(self._workspace)
        self.values_at, self.variance_at = (address(array, np.float64) for array in (self.values, self.variance))
        self.covariance_at = 0
        """Where the covariance (c, n, n) of the lighting that was taken lies in memory, not yet relative."""

    def take(self, lighting: Lighting, exposure: Array) -> None:
        """Make a lighting relative to its level, and that to an exposure (c,).

        Raises:
            ValueError: the lighting is of another shape.
        """
        channels, size = self.values.shape
        if lighting.covariance.shape != (channels, size, size):
            raise ValueError(f"covariance must be {(channels, size, size)}, found {lighting.covariance.shape}")
        self._covariance = np.ascontiguousarray(lighting.covariance, float)
        self.covariance_at = address(self._covariance, np.float64)
        coefficients = np.ascontiguousarray(lighting.coefficients, complex)
        _LIBRARY.take(self._at, address(coefficients, np.complex128), self.covariance_at, address(exposure, np.float64))

    def give(self, exposure: Array, shape: Array) -> tuple[NDArray[np.complex128], Array]:
        """Coefficients (k, c) under an exposure (c,), and their covariance (c, n, n).

        Args:
            exposure: what the level is relative to.
            shape: (c, n, n) covariance of relative light whose correlations are taken; the variances are the light's.
        """
        channels, size = self.values.shape
        coefficients = np.empty(((size + 1) // 2, channels), complex)
        covariance = np.empty((channels, size, size))
        _LIBRARY.give(
            self._at, address(exposure, np.float64), address(shape, np.float64),
            address(coefficients, np.complex128), address(covariance, np.float64),
        )  # fmt: skip
        return coefficients, covariance
