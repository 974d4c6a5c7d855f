"""A Kalman filter with fading memory: what is older than its memory counts less and less, at any frame rate."""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.relative_light import RelativeLight
from arlight.native import Workspace, address, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "followed_light")
_LIBRARY.memory_start.argtypes = [ctypes.c_void_p] * 4
_LIBRARY.memory_predict.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p]
_LIBRARY.memory_free_level.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_double]
_LIBRARY.memory_correct.argtypes = _LIBRARY.memory_judge.argtypes = [ctypes.c_void_p] * 3
_LIBRARY.memory_averaged.argtypes = [ctypes.c_void_p]
_LIBRARY.memory_tell.argtypes = [ctypes.c_void_p, *([ctypes.c_double] * 3), *([ctypes.c_void_p] * 2)]
_LIBRARY.memory_averaged.restype = ctypes.c_double
for _function in ("start", "predict", "free_level", "correct", "judge", "tell"):
    getattr(_LIBRARY, f"memory_{_function}").restype = None
_RUNNING = ("growth", "weights", "squared_weights", "level_freed")
_ARRAYS = ("values", "velocity", "variance", "cross", "moving", "corrected")


class _Shared(Workspace):
    """What memory.h calls Memory."""

    _fields_ = (
        ("channels", ctypes.c_int64),
        ("size", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
        ("memory_s", ctypes.c_double),
        ("trend", ctypes.c_int64),
        *((name, ctypes.c_double) for name in ("growth", "weights", "squared_weights")),
        ("level_freed", ctypes.c_int64),
    )


class FadingMemory:
    """Averages numbers with their variances over a memory; with a trend it also follows a steady change.

    Multiplying the variance by exp(dt/memory) at every step is the Kalman filter whose process noise keeps the balance
    between old and new the same whatever the measurements' variance is. While errors keep their correlations the
    filter of the whole vector does to each of its numbers what is done here.

    Args:
        memory_s: the memory [s].
        channels, size: shape (c, n) of the numbers, arrays of which stay where they are. The first of each channel is
            its level, which `judge` leaves out.
        trend: whether the numbers have a velocity.
    """

    def __init__(self, memory_s: float, channels: int, size: int, *, trend: bool) -> None:
        arrays = dict(zip(_ARRAYS, np.zeros((len(_ARRAYS), channels, size)), strict=True))
        self.values, self.velocity, self.variance = (arrays[name] for name in _ARRAYS[:3])
        self.cross, self.moving, self.corrected = (arrays[name] for name in _ARRAYS[3:])
        self.shared = _Shared(channels, size, memory_s=memory_s, trend=trend)
        """The compiled part's view of it."""
        self.shared.hold(arrays)
        self._at = ctypes.byref(self.shared)

    def start(self, values: Array, variance: Array, rate: Array) -> None:
        """Begin with values (c, n), their variance (c, n) and the spread (c, n) of velocities [1/s]."""
        arrays = (np.ascontiguousarray(array, float) for array in (values, variance, rate**2))
        _LIBRARY.memory_start(self._at, *(address(array, np.float64) for array in arrays))

    def adopt(self, other: "FadingMemory", doubt: Array) -> None:
        """Go on with the first numbers of another memory; where it has fewer, the present ones become doubtful.

        Args:
            other: of the same memory and trend.
            doubt: (c, n) variance of the numbers that it does not have.
        """
        count = min(self.values.shape[1], other.values.shape[1])
        self.variance[:, count:] = doubt[:, count:]
        for name in _ARRAYS:
            getattr(self, name)[:, :count] = getattr(other, name)[:, :count]
        for name in _RUNNING:
            setattr(self.shared, name, getattr(other.shared, name))

    def predict(self, dt: float, ceiling: Array) -> None:
        """Carry the state on by dt [s]; its variance grows up to `ceiling` (c, n) and no further."""
        _LIBRARY.memory_predict(self._at, dt, address(ceiling, np.float64))

    def free_level(self, channel: int, variance: float) -> None:
        """Grant a channel's level a sudden change of some variance."""
        _LIBRARY.memory_free_level(self._at, channel, variance)

    def correct(self, innovation: Array, measured: RelativeLight) -> None:
        """Take in a measurement by how far each of its values is taken to lie from the memory's (c, n)."""
        _LIBRARY.memory_correct(self._at, address(innovation, np.float64), ctypes.byref(measured.shared))

    def judge(self, measured: RelativeLight) -> tuple[float, float, float]:
        """Means over all but the levels of how a measurement compares.

        Returns:
            Its squared distance from the values over the variance of that distance; the same over its own variance;
            the variance of `corrected` over its own.
        """
        means = (ctypes.c_double * 3)()
        _LIBRARY.memory_judge(self._at, ctypes.byref(measured.shared), means)
        surprise, shown, kept = means
        return surprise, shown, kept

    @property
    def averaged(self) -> float:
        """Variance after the last measurement over `corrected`, if all errors are independent and nothing changes.

        `variance` allows for change: of measurements of weight w it is R / sum w, where R sum w^2 / (sum w)^2 is due.
        """
        return float(_LIBRARY.memory_averaged(self._at))

    def tell(self, light: RelativeLight, weight: float, independent: float, left: float, typical: Array) -> None:
        """Add a weight of the values, and of the variances that their errors have, to a light.

        Args:
            light: that is added to.
            weight: of this memory among others.
            independent: share of the measurements' errors that is independent from one to the next.
            left: share of a measurement's variance that averaging leaves beside.
            typical: (c, n) variance of a measurement.
        """
        _LIBRARY.memory_tell(
            self._at, weight, independent, left, address(typical, np.float64), ctypes.byref(light.shared)
        )
