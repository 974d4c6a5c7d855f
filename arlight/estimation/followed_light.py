"""One light followed over time, by two filters side by side.

Two Kalman filters with fading memory: a long one for light that stays, a short one with a trend for light that moves.
The one whose predictions the frames confirm is heard. A frame that neither foresaw is a switched light: both start anew
from it.

Both work on light relative to its level, and let the level of each channel go as fast as the frames show it to: an
automatic exposure or white balance then costs the level's averaging, not that of the light's shape.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.common_error import CommonError
from arlight.estimation.lighting import Lighting
from arlight.estimation.memory import FadingMemory
from arlight.estimation.prior import prior_stddev
from arlight.estimation.relative_light import RelativeLight
from arlight.estimation.typical_error import TypicalError
from arlight.native import Workspace, address, library

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "followed_light")
_LIBRARY.begin.argtypes = [ctypes.c_void_p] * 4
_LIBRARY.begin.restype = None
_LIBRARY.follow.argtypes = [*([ctypes.c_void_p] * 4), ctypes.c_double, ctypes.c_int, *([ctypes.c_void_p] * 2)]
_STILL_MEMORY_S = 1.5
_MOVING_MEMORY_S = 0.25
_MOST_CHANNELS = 4


class _Shared(Workspace):
    """What followed_light.c calls FollowedLight."""

    _fields_ = (
        ("frame", ctypes.c_void_p),
        ("told", ctypes.c_void_p),
        ("memories", ctypes.c_void_p * 2),
        ("common", ctypes.c_void_p),
        ("typical", ctypes.c_void_p),
        ("ceiling", ctypes.c_void_p),
        ("errors", ctypes.c_double * 2),
        ("usual", ctypes.c_double),
        ("level_errors", ctypes.c_double * _MOST_CHANNELS),
    )


class FollowedLight:
    """The state of the temporal filter: everything that is known of one light, in arrays that stay.

    Args:
        measured: the first estimate.
        exposure: (c,) what its levels are relative to.
    """

    def __init__(self, measured: Lighting, exposure: Array) -> None:
        shape = measured.covariance.shape[:2]
        self.frequencies = measured.frequencies
        frame, told = RelativeLight(*shape), RelativeLight(*shape)
        memories = (
            FadingMemory(_STILL_MEMORY_S, *shape, trend=False),
            FadingMemory(_MOVING_MEMORY_S, *shape, trend=True),
        )
        common = CommonError(len(memories), *shape)
        typical = TypicalError(_STILL_MEMORY_S, frame, memories)
        self._exposure = np.ones(shape[0])
        self._shared = _Shared(
            frame=ctypes.addressof(frame.shared), told=ctypes.addressof(told.shared),
            common=ctypes.addressof(common.shared), typical=ctypes.addressof(typical.shared),
            memories=(ctypes.c_void_p * 2)(*(ctypes.addressof(memory.shared) for memory in memories)),
            usual=1.0,
            level_errors=(ctypes.c_double * _MOST_CHANNELS)(*[1.0] * _MOST_CHANNELS),
        )  # fmt: skip
        # what is pointed at
        self._frame, self._told, self._common, self._typical = frame, told, common, typical
        self._memories = memories
        self._ceiling = np.tile(prior_stddev(measured.frequencies, 1.0) ** 2, (shape[0], 1))
        self._shared.hold({"ceiling": self._ceiling, "exposure": self._exposure})
        self._at = ctypes.byref(self._shared)
        self._exposure_at = address(self._exposure, np.float64)
        self._exposure[:] = exposure
        _LIBRARY.begin(self._at, *self._read(measured), self._exposure_at)

    def of_frequencies(self, measured: Lighting, exposure: Array) -> "FollowedLight":
        """The same light with the frequencies of another estimate, more or fewer of the same sequence.

        What both have goes on as it was; what is new begins with the estimate, to be taken in next.

        Args: as for the constructor.
        """
        other = FollowedLight(measured, exposure)
        for own, others in zip(self._memories, other._memories, strict=True):
            others.adopt(own, other._ceiling)
        other._common.adopt(self._common)
        other._typical.adopt(self._typical)
        for name in ("errors", "usual", "level_errors"):
            setattr(other._shared, name, getattr(self._shared, name))
        return other

    def follow(
        self, measured: Lighting | None, exposure: Array, dt: float, time_s: float, *, still: bool
    ) -> Lighting | None:
        """The light at a frame as its exposure records it.

        Args:
            measured: the frame's estimate, of the same frequencies as the first; None for a frame without one.
            exposure: (c,) what levels are relative to.
            dt: time since the last frame [s].
            time_s: the frame's time [s].
            still: whether, without an estimate, the light stands still from now on.

        Returns:
            None when the estimate shows another light: that is followed from now on.

        Raises:
            ValueError: the estimate is of another shape.
        """
        channels, size = self._exposure.shape[0], 2 * len(self.frequencies) - 1
        coefficients, covariance = (
            np.empty((len(self.frequencies), channels), complex),
            np.empty((channels, size, size)),
        )
        self._exposure[:] = exposure
        estimate = (None, None) if measured is None else self._read(measured)
        told = _LIBRARY.follow(
            self._at, *estimate, self._exposure_at, dt, measured is None and still,
            address(coefficients, np.complex128), address(covariance, np.float64),
        )  # fmt: skip
        chi2 = float("nan") if measured is None else measured.chi2
        return Lighting(self.frequencies, coefficients, covariance, time_s, chi2) if told else None

    def _read(self, measured: Lighting) -> tuple[int, int]:
        """Where an estimate's coefficients and covariance lie in memory until the next one is read."""
        coefficients = np.ascontiguousarray(measured.coefficients, complex)
        covariance = np.ascontiguousarray(measured.covariance, float)
        count, channels = len(self.frequencies), len(self._exposure)
        if coefficients.shape != (count, channels) or covariance.shape != (channels, 2 * count - 1, 2 * count - 1):
            raise ValueError(
                f"an estimate of {count} frequencies and {channels} channels was expected, found coefficients "
                f"{coefficients.shape} with covariance {covariance.shape}"
            )
        self._last = coefficients, covariance
        return address(coefficients, np.complex128), address(covariance, np.float64)
