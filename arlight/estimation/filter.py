"""Temporal filter of the coefficients: still, moving and switched light, under any exposure.

Two Kalman filters with fading memory run side by side: a long one for light that stays, a short one with a trend for
light that moves. The one whose predictions the frames confirm is heard. A frame that neither foresaw is a switched
light: both start anew from it.

Both work on light relative to its level, and let the level of each channel go as fast as the frames show it to: an
automatic exposure or white balance then costs the level's averaging, not that of the light's shape.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.common_error import CommonError
from arlight.estimation.lighting import Lighting
from arlight.estimation.memory import FadingMemory, shrinkage
from arlight.estimation.prior import prior_stddev
from arlight.estimation.relative_light import absolute_light, relative_light

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


class LightingFilter:
    """Follows the lighting; `update` with an estimate, or without one while the sheet is hidden."""

    def __init__(self) -> None:
        self._still = FadingMemory(_STILL_MEMORY_S, trend=False)
        self._moving = FadingMemory(_MOVING_MEMORY_S, trend=True)
        self._memories = (self._still, self._moving)
        self._common = CommonError(_STILL_MEMORY_S, len(self._memories))
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._last: Lighting | None = None
        self._errors = np.ones(2)
        self._usual = 1.0
        self._level_error = np.ones(3)
        self._common.reset()

    def update(self, measured: Lighting | None, time_s: float) -> Lighting | None:
        """The filtered lighting at a frame's time.

        Args:
            measured: the frame's own estimate; None when the sheet was not seen.
            time_s: the frame's time [s]; a time before the last one counts as the same.

        Returns:
            Coefficients with covariance; None before the first estimate.
        """
        if self._last is None:
            self._last = self._start(measured) if measured is not None else None
            return self._last
        time_s = max(time_s, self._last.time_s)
        dt = time_s - self._last.time_s
        ceiling = _natural_variance(self._last)
        if measured is None:
            # nothing confirms a trend while the sheet is hidden
            self._moving.velocity[:] = 0.0
        for memory in self._memories:
            memory.predict(dt, ceiling)
        if measured is not None and not self._take_in(measured, dt):
            self._last = self._start(measured)
            return self._last
        chi2 = float("nan") if measured is None else measured.chi2
        self._last = self._heard(self._last.frequencies, time_s, chi2, ceiling)
        return self._last

    def _start(self, measured: Lighting) -> Lighting:
        values, covariance = relative_light(measured)
        rate = np.sqrt(_natural_variance(measured))
        for memory in self._memories:
            memory.start(values, covariance, rate)
        self._errors = np.full(2, self._usual)
        self._common.start(values, covariance)
        return measured

    def _take_in(self, measured: Lighting, dt: float) -> bool:
        """Judge the predictions and correct them; False when the frame shows another light."""
        values, covariance = relative_light(measured)
        surprises = np.array([_surprise(memory, values, covariance) for memory in self._memories])
        if surprises.min() > _SWITCH * self._usual:
            return False
        share = 1.0 - np.exp(-dt / _JUDGING_S)
        self._errors += share * (surprises - self._errors)
        self._usual += 0.1 * (surprises.min() - self._usual)
        self._common.learn(values, covariance, self._memories, dt)
        self._free_level(values[:, 0], covariance[:, 0, 0], share)
        for memory in self._memories:
            memory.correct(values, covariance)
        return True

    def _free_level(self, level: Array, variance: Array, share: float) -> None:
        """Let the level go where it is seen to jump or to drift."""
        error = (level - self._still.values[:, 0]) ** 2 / (variance + self._still.covariance[:, 0, 0])
        self._level_error += share * (error - self._level_error)
        drifting = _between(self._level_error, _DRIFTING_FROM, _DRIFTING_FULLY)
        for memory in self._memories:
            known = variance + memory.covariance[:, 0, 0]
            jump = np.maximum((level - memory.values[:, 0]) ** 2 - _LEVEL_JUMP * known, 0.0)
            memory.loosen(0, jump + drifting * _FOLLOWED * variance)

    def _heard(self, frequencies: NDArray[np.int64], time_s: float, chi2: float, ceiling: Array) -> Lighting:
        share = float(_between(self._errors[:1] / max(self._errors[1], _LEAST_ERROR), _MOVING_FROM, _MOVING_FULLY)[0])
        weights = (1.0 - share, share)
        values = np.zeros_like(self._still.values)
        covariance = np.zeros_like(self._still.covariance)
        for which, (weight, memory) in enumerate(zip(weights, self._memories, strict=True)):
            values += weight * memory.values
            # while the sheet is hidden the light may change
            covariance += weight * memory.growth * self._common.covariance(which, memory.averaged)
        scale = shrinkage(covariance, ceiling)
        covariance = covariance * scale[:, :, None] * scale[:, None, :]
        coefficients, covariance = absolute_light(values, covariance)
        return Lighting(frequencies, coefficients, covariance, time_s, chi2)


def _between(value: Array, low: float, high: float) -> Array:
    """0 up to `low`, 1 from `high` on."""
    return np.clip((value - low) / (high - low), 0.0, 1.0)


def _natural_variance(lighting: Lighting) -> Array:
    """(3, 2k - 1) variance of natural light of this brightness: of its level, then relative to it."""
    irradiance = np.maximum(lighting.coefficients[0].real, 1e-3)
    spread = np.stack([prior_stddev(lighting.frequencies, level) / level for level in irradiance])
    spread[:, 0] = irradiance
    return spread**2


def _surprise(memory: FadingMemory, values: Array, covariance: Array) -> float:
    """Squared prediction error over the measurement's own variance, a coefficient."""
    variance = np.einsum("cii->ci", covariance) + np.einsum("cii->ci", memory.covariance)
    error = (values - memory.values) ** 2 / variance
    return float(np.mean(error[:, 1:] if error.shape[1] > 1 else error))
