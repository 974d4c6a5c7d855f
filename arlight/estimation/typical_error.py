"""The covariance that the frames' errors typically have, and what follows from how they correlate.

A frame's estimate errs along some combinations of coefficients more than along others, and which ones changes with the
view. The filter follows every coefficient by itself, with its own variance; how a memory's errors correlate is taken
from the frames before. With variances and correlations the innovations are those of the Kalman filter of the whole
vector, P (P + R)^-1, which take no direction more than wholly, however the frames' covariances change.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.memory import FadingMemory
from arlight.estimation.relative_light import RelativeLight
from arlight.native import Workspace, address, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "followed_light")
_LIBRARY.typical_start.argtypes = _LIBRARY.typical_weigh.argtypes = [ctypes.c_void_p] * 2
_LIBRARY.typical_average.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double]
for _function in ("start", "weigh", "average"):
    getattr(_LIBRARY, f"typical_{_function}").restype = None
_WIDE, _PANEL = 16, 4
"""Floats of a vector and rows that are eliminated together (cholesky.h)."""


class _Shared(Workspace):
    """What typical_error.h calls TypicalError."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        ("memory_s", ctypes.c_double),
        ("weight", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("covariance", "diagonal", "frame")),
        ("many", ctypes.c_int64),
        ("memories", ctypes.POINTER(ctypes.c_void_p)),
        *((name, ctypes.c_void_p) for name in ("innovation", "terms", "equation", "solution", "shares")),
    )


class TypicalError:
    """Mean of the frames' covariances with fading weights, and innovations weighed by correlations.

    Args:
        memory_s: time over which covariances are averaged [s].
        frame: the relative light of the frames, which is taken anew for each.
        memories: whose innovations are weighed.
    """

    def __init__(self, memory_s: float, frame: RelativeLight, memories: tuple[FadingMemory, ...]) -> None:
        channels, size = frame.values.shape
        stride = (size + _WIDE) // _WIDE * _WIDE
        self.covariance = np.zeros((channels, size, size))
        """(c, n, n) of relative light."""
        self.diagonal = np.zeros((channels, size))
        """(c, n) its variances."""
        self._innovation = np.zeros((len(memories), channels, size))
        # pointed at
        self._frame, self._memories = frame, memories
        pointers = ctypes.c_void_p * len(memories)
        self.shared = _Shared(
            channels, size, memory_s, frame=ctypes.addressof(frame.shared), many=len(memories),
            memories=pointers(*(ctypes.addressof(memory.shared) for memory in memories)),
        )  # fmt: skip
        """The compiled part's view of it."""
        self.shared.hold(
            {
                "covariance": self.covariance,
                "diagonal": self.diagonal,
                "innovation": self._innovation,
                "terms": np.zeros((4, size)),
                "equation": np.zeros((size + _PANEL, stride), np.float32),
                "solution": np.zeros(stride, np.float32),
                "shares": np.zeros((3, size)),
            }
        )
        self._at = ctypes.byref(self.shared)

    def start(self, covariance: Array) -> None:
        """Begin with the covariance (c, n, n) of the frame's light, not relative."""
        _LIBRARY.typical_start(self._at, address(covariance, np.float64))

    def adopt(self, other: "TypicalError") -> None:
        """Go on with the first numbers of another; the rest is as the first frame had it, uncorrelated to those."""
        count = min(self.diagonal.shape[1], other.diagonal.shape[1])
        # correlations with errors of another size would be none
        self.covariance[:, :count, count:] = self.covariance[:, count:, :count] = 0.0
        self.covariance[:, :count, :count] = other.covariance[:, :count, :count]
        self.diagonal[:, :count] = other.diagonal[:, :count]
        self.shared.weight = other.shared.weight

    def average(self, covariance: Array, dt: float) -> None:
        """Take in the same dt [s] after the last frame; a less certain frame counts less."""
        _LIBRARY.typical_average(self._at, address(covariance, np.float64), dt)

    def weigh(self, covariance: Array) -> Array:
        """Innovations (memories, c, n) of the frame that each of the memories' numbers should take in by itself.

        A level that is less certain than the rest, as after a change of exposure, first takes what only its shift
        explains; the array is overwritten by the next call.

        Args:
            covariance: (c, n, n) of the frame's light, not relative.
        """
        _LIBRARY.typical_weigh(self._at, address(covariance, np.float64))
        return self._innovation
