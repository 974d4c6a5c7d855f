"""Temporal filter of the coefficients: still, moving and switched light, under any exposure."""

import math

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.followed_light import FollowedLight
from arlight.estimation.lighting import Lighting

Array = NDArray[np.float64]

_ONES = np.ones(3)


class LightingFilter:
    """Follows the lighting; `update` with an estimate, or without one while the sheet is hidden."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._light: FollowedLight | None = None
        self._time_s = -math.inf

    def update(
        self, measured: Lighting | None, time_s: float, exposure: Array | None = None, *, hidden: bool = True
    ) -> Lighting | None:
        """The filtered lighting at a frame's time.

        Args:
            measured: the frame's own estimate; None for a frame without one.
            time_s: the frame's time [s]; a time before the last one counts as the same.
            exposure: (3,) how brightly the frame records each channel, up to a factor that stays the same; light is
                followed relative to it and told as the frame records it. Ones by default.
            hidden: whether a frame without an estimate did not show the sheet, so that nothing confirms a trend; a
                frame that was only left out is predicted with it.

        Returns:
            Coefficients with covariance, of the frequencies of the last estimate; None before the first, which is
            returned as it is.
        """
        exposure = _ONES if exposure is None else exposure
        if self._light is None:
            if measured is not None:
                self._light, self._time_s = FollowedLight(measured, exposure), time_s
            return measured
        if measured is not None and len(measured.frequencies) != len(self._light.frequencies):
            self._light = self._light.of_frequencies(measured, exposure)
        time_s = max(time_s, self._time_s)
        dt, self._time_s = time_s - self._time_s, time_s
        # nothing confirms a trend while the sheet is hidden
        told = self._light.follow(measured, exposure, dt, time_s, still=hidden)
        return measured if told is None else told
