"""What averaging over time leaves: errors that neighbouring frames have in common.

Of a frame's error, of covariance R, a share is independent from frame to frame; the rest is common to frames from
nearly the same view and dies away as the view changes. Against its own mean with exponential weights an error c that
dies away exponentially strays by E (c - <c>)^2 = (1 - left) E c^2, and E <c>^2 = left E c^2 is what it leaves in the
mean, however fast it dies away. So nobody needs to know how fast the view changes: what the prediction errors do not
show of R is in the mean.
"""

import ctypes

import numpy as np

from arlight.estimation.relative_light import RelativeLight
from arlight.native import Workspace, library

_LIBRARY = library(__file__, "followed_light")
_LIBRARY.common_start.argtypes = [ctypes.c_void_p] * 2
_LIBRARY.common_learn.argtypes = [*([ctypes.c_void_p] * 4), ctypes.c_double]
_LIBRARY.common_independent.argtypes = [ctypes.c_void_p]
_LIBRARY.common_left.argtypes = [ctypes.c_void_p, ctypes.c_int]
_LIBRARY.common_start.restype = _LIBRARY.common_learn.restype = None
_LIBRARY.common_independent.restype = _LIBRARY.common_left.restype = ctypes.c_double
_MOST_MEANS = 2


class _Average(ctypes.Structure):
    """What common_error.h calls Average."""

    _fields_ = (("value", ctypes.c_double), ("count", ctypes.c_int64))


class _Shared(Workspace):
    """What common_error.h calls CommonError."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("channels", "size", "means")),
        ("values", ctypes.c_void_p),
        ("variance", ctypes.c_void_p),
        ("seen", ctypes.c_int64),
        ("independent", _Average),
        *((name, _Average * _MOST_MEANS) for name in ("shown", "lately", "averaged")),
    )


class CommonError:
    """Learns from the frames how much of their error is independent, and what of the rest several means keep.

    Args:
        means: how many means there are, one or two.
        channels, size: shape (c, n) of the frames' numbers; the first of each channel is its level, which an exposure
            changes as well: it is not judged.
    """

    def __init__(self, means: int, channels: int, size: int) -> None:
        if not 1 <= means <= _MOST_MEANS:
            raise ValueError(f"means must be 1 or {_MOST_MEANS}, found {means}")
        self._means = means
        self.shared = _Shared(channels, size, means)
        """The compiled part's view of it."""
        self.shared.hold({name: np.zeros((3, channels, size)) for name in ("values", "variance")})
        self._at = ctypes.byref(self.shared)

    def start(self, frame: RelativeLight) -> None:
        """Another light, seen first in a frame: what is known of the errors is kept."""
        _LIBRARY.common_start(self._at, ctypes.byref(frame.shared))

    def adopt(self, other: "CommonError") -> None:
        """Keep what another knows of the errors; the frames that it saw may be of other frequencies."""
        for name in ("independent", "shown", "lately", "averaged"):
            setattr(self.shared, name, getattr(other.shared, name))

    @property
    def independent(self) -> float:
        """Share of a frame's error that is independent of the other frames', in [0, 1]."""
        return float(_LIBRARY.common_independent(self._at))

    def learn(self, frame: RelativeLight, shown: list[float], averaged: list[float], dt: float) -> None:
        """Take in a frame dt [s] after the last.

        Args:
            frame: its light.
            shown: of each mean, the squared distance of the frame from it over the frame's variance.
            averaged: of each mean, its variance over the frame's if the errors of all frames were independent.
            dt: time since the last frame [s].
        """
        numbers = ctypes.c_double * self._means
        _LIBRARY.common_learn(self._at, ctypes.byref(frame.shared), numbers(*shown), numbers(*averaged), dt)

    def left(self, which: int) -> float:
        """Share of a frame's variance that is left in a mean, beside what averaging leaves of the independent share.

        Args:
            which: place of the mean among those that `learn` was told of.
        """
        return float(_LIBRARY.common_left(self._at, which))
