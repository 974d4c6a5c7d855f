"""The covariance that the frames' errors typically have, and what follows from how they correlate.

A frame's estimate errs along some combinations of coefficients more than along others, and which ones changes with the
view. The filter follows every coefficient by itself and leaves correlations to this: an innovation is first divided by
how the frame's errors correlate, then multiplied by how those of all the frames before do. With one gain for all
coefficients that is the Kalman filter of the whole vector, P (P + R)^-1, whose P keeps the typical correlations.
"""

import ctypes
import math

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.memory import FadingMemory
from arlight.estimation.relative_light import RelativeLight
from arlight.native import Workspace, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "typical_error")
_LIBRARY.average.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
_LIBRARY.uncertainty.argtypes = [ctypes.c_void_p]
_LIBRARY.uncertainty.restype = ctypes.c_double
_LIBRARY.weigh.argtypes = [ctypes.c_void_p] * 2
_LANES = 16
"""Floats by which rows of factors are padded (cholesky.h)."""
_FRAME = ("values", "variance", "scale", "slope", "arm")


class _Workspace(Workspace):
    """What typical_error.c calls TypicalError."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("covariance", "diagonal", *_FRAME)),
        ("many", ctypes.c_int64),
        *((name, ctypes.POINTER(ctypes.c_void_p)) for name in ("memory_values", "memory_variance")),
        *((name, ctypes.c_void_p) for name in ("innovation", "terms", "factor", "sides")),
    )


class TypicalError:
    """Mean of the frames' covariances with fading weights, and innovations weighed by correlations.

    Args:
        memory_s: time over which covariances are averaged [s].
        frame: the relative light of the frames, which is taken anew for each.
        memories: whose innovations are weighed.
    """

    def __init__(self, memory_s: float, frame: RelativeLight, memories: tuple[FadingMemory, ...]) -> None:
        self._memory_s = memory_s
        self._frame = frame
        # their arrays are pointed at
        self._memories = memories
        channels, size = frame.values.shape
        stride = -(-size // _LANES) * _LANES
        self.covariance = np.zeros((channels, size, size))
        """(c, n, n) of relative light."""
        self.diagonal = np.zeros((channels, size))
        """(c, n) its variances."""
        self._innovation = np.zeros((len(memories), channels, size))
        pointers = ctypes.c_void_p * len(memories)
        self._workspace = _Workspace(channels, size)
        self._workspace.many = len(memories)
        self._workspace.memory_values = pointers(*(memory.values_at for memory in memories))
        self._workspace.memory_variance = pointers(*(memory.variance_at for memory in memories))
        self._workspace.hold(
            {
                "covariance": self.covariance,
                "diagonal": self.diagonal,
                **{name: getattr(frame, name) for name in _FRAME},
                "innovation": self._innovation,
                "terms": np.zeros((4, size)),
                "factor": np.zeros((stride, stride), np.float32),
                "sides": np.zeros((2, len(memories) + 1, stride), np.float32),
            }
        )
        self._at = ctypes.byref(self._workspace)

    def start(self) -> None:
        """Begin with the frame's covariance."""
        self.covariance[:] = 0.0
        _LIBRARY.average(self._at, self._frame.covariance_at, 0.0, 1.0)
        self._weight = 1.0

    def average(self, dt: float) -> None:
        """Take in the frame's covariance dt [s] after the last one's; a less certain frame counts less."""
        faded = self._weight * math.exp(-dt / self._memory_s)
        weight = 1.0 / _LIBRARY.uncertainty(self._at)
        self._weight = faded + weight
        _LIBRARY.average(self._at, self._frame.covariance_at, faded / self._weight, weight / self._weight)

    def weigh(self) -> Array:
        """Innovations (memories, c, n) of the frame that each of the memories' numbers should take in by itself.

        A level that is less certain than the rest, as after a change of exposure, first takes what only its shift
        explains; the array is overwritten by the next call.
        """
        _LIBRARY.weigh(self._at, self._frame.covariance_at)
        return self._innovation
