"""A Kalman filter with fading memory: what is older than its memory counts less and less, at any frame rate."""

import ctypes
import math

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.relative_light import RelativeLight
from arlight.native import Workspace, address, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "memory")
_LIBRARY.predict.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_void_p]
_LIBRARY.correct.argtypes = [ctypes.c_void_p] * 3
_LIBRARY.judge.argtypes = [ctypes.c_void_p] * 4
_LIBRARY.tell.argtypes = [ctypes.c_void_p, *([ctypes.c_double] * 4), *([ctypes.c_void_p] * 3)]
_ARRAYS = ("values", "velocity", "variance", "cross", "moving", "corrected")


class _Workspace(Workspace):
    """What memory.c calls Memory."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
    )


class FadingMemory:
    """Averages numbers with their variances over a memory; with a trend it also follows a steady change.

    Multiplying the variance by exp(dt/memory) at every step is the Kalman filter whose process noise keeps the balance
    between old and new the same whatever the measurements' variance is. While errors keep their correlations the
    filter of the whole vector does to each of its numbers what is done here.

    Args:
        memory_s: the memory [s].
        trend: whether the numbers have a velocity.
        channels, size: shape (c, n) of the numbers, arrays of which stay where they are. The first of each channel is
            its level, which `judge` leaves out.
    """

    def __init__(self, memory_s: float, channels: int, size: int, *, trend: bool) -> None:
        self._memory_s = memory_s
        self._trend = trend
        arrays = dict(zip(_ARRAYS, np.zeros((len(_ARRAYS), channels, size)), strict=True))
        self.values, self.velocity, self.variance = (arrays[name] for name in _ARRAYS[:3])
        self.cross, self.moving, self.corrected = (arrays[name] for name in _ARRAYS[3:])
        self._workspace = _Workspace(channels, size)
        self._workspace.hold(arrays)
        self._at = ctypes.byref(self._workspace)
        self._means = np.zeros(3)
        self._means_at = address(self._means, np.float64)
        self.values_at, self.variance_at = (address(a, np.float64) for a in (self.values, self.variance))

    def start(self, values: Array, variance: Array, rate: Array) -> None:
        """Begin with values (c, n), their variance (c, n) and the spread (c, n) of velocities [1/s]."""
        self.values[:] = values
        self.variance[:] = self.corrected[:] = variance
        self.velocity[:] = self.cross[:] = 0.0
        self.moving[:] = rate**2 if self._trend else 0.0
        self._growth = 1.0
        self._level_freed = False
        self._weights = self._squared_weights = 1.0

    def predict(self, dt: float, ceiling: Array) -> None:
        """Carry the state on by dt [s]; its variance grows up to `ceiling` (c, n) and no further."""
        growth = math.exp(min(dt / self._memory_s, 50.0))
        self._growth *= growth
        _LIBRARY.predict(self._at, dt, growth, address(ceiling, np.float64))

    def free_level(self, channel: int, variance: float) -> None:
        """Grant a channel's level a sudden change of some variance."""
        self.variance[channel, 0] += variance
        self._level_freed = True

    def correct(self, innovation: Array, measured: RelativeLight) -> None:
        """Take in a measurement by how far each of its values is taken to lie from the memory's (c, n)."""
        _LIBRARY.correct(self._at, address(innovation, np.float64), measured.variance_at)
        self._weights = self._weights / self._growth + 1.0
        self._squared_weights = self._squared_weights / self._growth**2 + 1.0
        self._growth = 1.0

    def judge(self, measured: RelativeLight) -> tuple[float, float, float]:
        """Means over all but the levels of how a measurement compares.

        Returns:
            Its squared distance from the values over the variance of that distance; the same over its own variance;
            the variance of `corrected` over its own.
        """
        _LIBRARY.judge(self._at, measured.values_at, measured.variance_at, self._means_at)
        surprise, shown, kept = self._means.tolist()
        return surprise, shown, kept

    @property
    def averaged(self) -> float:
        """Variance after the last measurement over `corrected`, if all errors are independent and nothing changes.

        `variance` allows for change: of measurements of weight w it is R / sum w, where R sum w^2 / (sum w)^2 is due.
        """
        share = self._squared_weights / self._weights
        # a straight line that fades: 1.25 (1 - fading) R at its end, where `variance` is 2 (1 - fading) R
        return min(1.25 * share, 1.0) if self._trend else share

    def tell(self, light: RelativeLight, weight: float, independent: float, left: float, typical: Array) -> None:
        """Add a weight of the values, and of the variances that their errors have, to a light.

        Args:
            light: that is added to.
            weight: of this memory among others.
            independent: share of the measurements' errors that is independent from one to the next.
            left: share of a measurement's variance that averaging leaves beside.
            typical: (c, n) variance of a measurement.
        """
        # without measurements the light may change
        grown = weight * self._growth
        kept_level = independent * (1.0 if self._level_freed else self.averaged)
        _LIBRARY.tell(
            self._at, weight, grown * independent * self.averaged, grown * kept_level, grown * left,
            address(typical, np.float64), light.values_at, light.variance_at,
        )  # fmt: skip
