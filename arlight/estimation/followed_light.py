"""One light followed over time, by two filters side by side.

Two Kalman filters with fading memory: a long one for light that stays, a short one with a trend for light that moves.
The one whose predictions the frames confirm is heard. A frame that neither foresaw is a switched light: both start anew
from it.

Both work on light relative to its level, and let the level of each channel go as fast as the frames show it to: an
automatic exposure or white balance then costs the level's averaging, not that of the light's shape.
"""

import math

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.common_error import CommonError
from arlight.estimation.lighting import Lighting
from arlight.estimation.memory import FadingMemory
from arlight.estimation.prior import prior_stddev
from arlight.estimation.relative_light import RelativeLight
from arlight.estimation.typical_error import TypicalError

Array = NDArray[np.float64]

_STILL_MEMORY_S = 1.5
_MOVING_MEMORY_S = 0.25
_JUDGING_S = 0.2
"""Time over which the two filters' predictions are compared [s]."""
_MOVING_FROM, _MOVING_FULLY = 1.6, 2.4
"""Ratio of the still filter's squared prediction error to the moving one's between which the light counts as moving."""
_LEAST_ERROR = 1.2
"""Squared prediction error that the ratio starts from: errors of neighbouring frames are alike, and a short memory
predicts them too well."""
_SWITCH = 6.0
"""Squared prediction error over its usual level from which a frame is a switch."""
_LEVEL_JUMP = 16.0
"""The same of a channel's level alone, from which its prediction is given up."""
_DRIFTING_FROM, _DRIFTING_FULLY = 3.0, 4.5
"""Mean squared prediction error of a level between which it counts as drifting."""
_FOLLOWED = 4.0
"""Variance that a drifting level gains between frames, relative to a measurement's: four fifths of it are followed."""
_DARKEST = 1e-3
"""Level below which a level's natural variance does not fall [radiance * sr]."""


class FollowedLight:
    """The state of the temporal filter: everything that is known of one light, in arrays that stay.

    Args:
        measured: the first estimate.
        exposure: (c,) what its levels are relative to.
    """

    def __init__(self, measured: Lighting, exposure: Array) -> None:
        shape = measured.covariance.shape[:2]
        self.frequencies = measured.frequencies
        self._frame, self._told = RelativeLight(*shape), RelativeLight(*shape)
        self._still = FadingMemory(_STILL_MEMORY_S, *shape, trend=False)
        self._moving = FadingMemory(_MOVING_MEMORY_S, *shape, trend=True)
        self._memories = (self._still, self._moving)
        self._common = CommonError(len(self._memories), *shape)
        self._typical = TypicalError(_STILL_MEMORY_S, self._frame, self._memories)
        self._ceiling = np.tile(prior_stddev(measured.frequencies, 1.0) ** 2, (shape[0], 1))
        self._usual = 1.0
        self._level_errors = [1.0] * shape[0]
        self._errors = [1.0] * len(self._memories)
        self._frame.take(measured, exposure)
        self._start()

    def stop(self) -> None:
        """Let the light stand still from now on."""
        self._moving.velocity[:] = 0.0

    def predict(self, dt: float) -> None:
        """Carry the light on by dt [s]."""
        for memory in self._memories:
            memory.predict(dt, self._ceiling)

    def take_in(self, measured: Lighting, exposure: Array, dt: float) -> bool:
        """Judge the predictions and correct them, dt [s] after the last estimate.

        Returns:
            False when the estimate shows another light: that is followed from now on.
        """
        self._frame.take(measured, exposure)
        judged = [memory.judge(self._frame) for memory in self._memories]
        surprises = [surprise for surprise, _, _ in judged]
        least = min(surprises)
        if least > _SWITCH * self._usual:
            self._start()
            return False
        share = 1.0 - math.exp(-dt / _JUDGING_S)
        self._errors = [error + share * (now - error) for error, now in zip(self._errors, surprises, strict=True)]
        self._usual += 0.1 * (least - self._usual)
        averaged = [memory.averaged * kept for memory, (_, _, kept) in zip(self._memories, judged, strict=True)]
        self._common.learn(self._frame, [shown for _, shown, _ in judged], averaged, dt)
        self._free_levels(share)
        for memory, innovation in zip(self._memories, self._typical.weigh(), strict=True):
            memory.correct(innovation, self._frame)
        self._typical.average(dt)
        return True

    def tell(self, exposure: Array, time_s: float, chi2: float) -> Lighting:
        """The light at a time [s] as an exposure (c,) records it."""
        told, typical = self._told, self._typical
        told.values.fill(0.0)
        told.variance.fill(0.0)
        moving = _between(self._errors[0] / max(self._errors[1], _LEAST_ERROR), _MOVING_FROM, _MOVING_FULLY)
        independent = self._common.independent
        for which, (weight, memory) in enumerate(zip((1.0 - moving, moving), self._memories, strict=True)):
            if weight > 0.0:
                memory.tell(told, weight, independent, self._common.left(which), typical.diagonal)
        np.minimum(told.variance, self._ceiling, out=told.variance)
        self._bound(told.values)
        coefficients, covariance = told.give(exposure, typical.covariance)
        return Lighting(self.frequencies, coefficients, covariance, time_s, chi2)

    def _start(self) -> None:
        self._bound(self._frame.values)
        rate = np.sqrt(self._ceiling)
        for memory in self._memories:
            memory.start(self._frame.values, self._frame.variance, rate)
        self._errors = [self._usual] * len(self._memories)
        self._common.start(self._frame)
        self._typical.start()

    def _bound(self, values: Array) -> None:
        """Variances grow up to those of natural light of its brightness: of its level, then relative to it."""
        np.maximum(values[:, 0], _DARKEST, out=self._ceiling[:, 0])
        self._ceiling[:, 0] **= 2

    def _free_levels(self, share: float) -> None:
        """Let the level of a channel go where it is seen to jump or to drift."""
        levels, variances = self._frame.values[:, 0].tolist(), self._frame.variance[:, 0].tolist()
        known = [(m, m.values[:, 0].tolist(), m.variance[:, 0].tolist()) for m in self._memories]
        for channel, (level, variance) in enumerate(zip(levels, variances, strict=True)):
            _, values, own = known[0]
            error = (level - values[channel]) ** 2 / (variance + own[channel])
            self._level_errors[channel] += share * (error - self._level_errors[channel])
            drift = _FOLLOWED * variance * _between(self._level_errors[channel], _DRIFTING_FROM, _DRIFTING_FULLY)
            for memory, values, own in known:
                jump = (level - values[channel]) ** 2 - _LEVEL_JUMP * (variance + own[channel])
                if drift > 0.0 or jump > 0.0:
                    memory.free_level(channel, max(jump, 0.0) + drift)


def _between(value: float, low: float, high: float) -> float:
    """0 up to `low`, 1 from `high` on."""
    return min(max((value - low) / (high - low), 0.0), 1.0)
