"""What averaging over time leaves: errors that neighbouring frames have in common.

Of a frame's error, of covariance R, a share is independent from frame to frame; the rest is common to frames from
nearly the same view and dies away as the view changes. Against its own mean with exponential weights an error c that
dies away exponentially strays by E (c - <c>)^2 = (1 - left) E c^2, and E <c>^2 = left E c^2 is what it leaves in the
mean, however fast it dies away. So nobody needs to know how fast the view changes: what the prediction errors do not
show of R is in the mean.
"""

import ctypes
import math

import numpy as np

from arlight.estimation.relative_light import RelativeLight
from arlight.native import Workspace, library

_LIBRARY = library(__file__, "common_error")
_LIBRARY.push.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p]
_LIBRARY.bend.argtypes = [ctypes.c_void_p, ctypes.c_int]
_LIBRARY.bend.restype = ctypes.c_double

_LEARNING_S = 1.0
"""Time over which shares are averaged [s]."""
_NEVER_SHOWN = 0.2
"""Least part of the common error that is left: what no change of view within the memory shows."""
_CHANGE_S = 0.15
"""Time over which prediction errors show that the light has changed [s]."""
_CHANCE = 1.15
"""Prediction errors over the expected ones that mean nothing."""


class _Workspace(Workspace):
    """What common_error.c calls LastFrames."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        ("values", ctypes.c_void_p),
        ("variance", ctypes.c_void_p),
    )


class CommonError:
    """Learns from the frames how much of their error is independent, and what of the rest several means keep.

    Args:
        means: how many means there are.
        channels, size: shape (c, n) of the frames' numbers; the first of each channel is its level, which an exposure
            changes as well: it is not judged.
    """

    def __init__(self, means: int, channels: int, size: int) -> None:
        self._means = range(means)
        self._last = _Workspace(channels, size)
        self._last.hold({name: np.zeros((3, channels, size)) for name in ("values", "variance")})
        self._at = ctypes.byref(self._last)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._independent = _Average()
        self._shown, self._lately, self._averaged = ([_Average() for _ in self._means] for _ in range(3))
        self._seen = 0

    def start(self, frame: RelativeLight) -> None:
        """Another light, seen first in a frame: what is known of the errors is kept."""
        self._seen = 0
        self._push(frame)

    @property
    def independent(self) -> float:
        """Share of a frame's error that is independent of the other frames', in [0, 1]."""
        return min(self._independent.value, 1.0)

    def learn(self, frame: RelativeLight, shown: list[float], averaged: list[float], dt: float) -> None:
        """Take in a frame dt [s] after the last.

        Args:
            frame: its light.
            shown: of each mean, the squared distance of the frame from it over the frame's variance.
            averaged: of each mean, its variance over the frame's if the errors of all frames were independent.
            dt: time since the last frame [s].
        """
        learning, change = (1.0 - math.exp(-dt / memory_s) for memory_s in (_LEARNING_S, _CHANGE_S))
        slot = self._push(frame)
        if self._seen >= 3:
            # light that moves steadily has no second difference
            self._independent.take(_LIBRARY.bend(self._at, slot), learning)
        for mean in self._means:
            self._shown[mean].take(shown[mean], learning)
            self._lately[mean].take(shown[mean], change)
            self._averaged[mean].take(averaged[mean], learning)

    def left(self, which: int) -> float:
        """Share of a frame's variance that is left in a mean, beside what averaging leaves of the independent share.

        Args:
            which: place of the mean among those that `learn` was told of.
        """
        independent = self.independent
        expected = independent * (1.0 + self._averaged[which].value)
        common = 1.0 - independent
        left = min(max(common - (self._shown[which].value - expected), _NEVER_SHOWN * common), common)
        # more shown than a frame can err: the mean lags behind the light, or all error bars are too narrow
        return left + max(self._lately[which].value - _CHANCE * (expected + common - left), 0.0)

    def _push(self, frame: RelativeLight) -> int:
        slot = self._seen % 3
        _LIBRARY.push(self._at, slot, frame.values_at, frame.variance_at)
        self._seen += 1
        return slot


class _Average:
    """An average with fading weights or, at first, over all there is."""

    __slots__ = ("_count", "value")

    def __init__(self) -> None:
        self.value = 0.0
        self._count = 0

    def take(self, value: float, share: float) -> None:
        self._count += 1
        self.value += max(share, 1.0 / self._count) * (value - self.value)
