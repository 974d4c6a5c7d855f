"""Temporal filter of the coefficients: still, moving and switched light.

Two Kalman filters with fading memory run side by side: a long one for light that stays, a short one with a trend for
light that moves. The one whose predictions the frames confirm is heard. A frame that neither foresaw is a switched
light: both start anew from it.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.estimation.memory import FadingMemory
from arlight.estimation.prior import prior_stddev
from arlight.fourier import pack_real, unpack_real

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
_COMMON_ERROR = 4.0
"""Frames in a row whose errors are alike, since they come from nearly the same view."""


class LightingFilter:
    """Follows the lighting; `update` with an estimate, or without one while the sheet is hidden."""

    def __init__(self) -> None:
        self._still = FadingMemory(_STILL_MEMORY_S, trend=False)
        self._moving = FadingMemory(_MOVING_MEMORY_S, trend=True)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._last: Lighting | None = None
        self._errors = np.ones(2)
        self._usual = 1.0

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
        ceiling = self._natural_variance(self._last)
        if measured is None:
            # nothing confirms a trend while the sheet is hidden
            self._moving.velocity[:] = 0.0
        for memory in (self._still, self._moving):
            memory.predict(dt, ceiling)
        if measured is not None and not self._take_in(measured, dt):
            self._last = self._start(measured)
            return self._last
        self._last = self._heard(self._last.frequencies, time_s, float("nan") if measured is None else measured.chi2)
        return self._last

    def _start(self, measured: Lighting) -> Lighting:
        values = pack_real(measured.coefficients).T
        rate = np.sqrt(self._natural_variance(measured))
        for memory in (self._still, self._moving):
            memory.start(values, measured.covariance, rate)
        self._errors = np.full(2, self._usual)
        return measured

    def _take_in(self, measured: Lighting, dt: float) -> bool:
        """Judge the predictions and correct them; False when the frame shows another light."""
        values = pack_real(measured.coefficients).T
        surprises = np.array([_surprise(memory, values, measured.covariance) for memory in (self._still, self._moving)])
        if surprises.min() > _SWITCH * self._usual:
            return False
        share = 1.0 - np.exp(-dt / _JUDGING_S)
        self._errors += share * (surprises - self._errors)
        self._usual += 0.1 * (surprises.min() - self._usual)
        for memory in (self._still, self._moving):
            memory.correct(values, measured.covariance)
        return True

    def _heard(self, frequencies: NDArray[np.int64], time_s: float, chi2: float) -> Lighting:
        ratio = self._errors[0] / max(self._errors[1], _LEAST_ERROR)
        share = float(np.clip((ratio - _MOVING_FROM) / (_MOVING_FULLY - _MOVING_FROM), 0.0, 1.0))
        values = (1.0 - share) * self._still.values + share * self._moving.values
        covariance = (1.0 - share) * self._still.covariance + share * self._moving.covariance
        return Lighting(frequencies, unpack_real(values.T), _COMMON_ERROR * covariance, time_s, chi2)

    def _natural_variance(self, lighting: Lighting) -> Array:
        """(3, 2k - 1) variance of natural light of this brightness."""
        irradiance = np.maximum(lighting.coefficients[0].real, 1e-3)
        spread = np.stack([prior_stddev(lighting.frequencies, level) for level in irradiance])
        spread[:, 0] = irradiance
        return spread**2


def _surprise(memory: FadingMemory, values: Array, covariance: Array) -> float:
    """Squared prediction error over the measurement's own variance, a coefficient."""
    variance = np.einsum("cii->ci", covariance) + np.einsum("cii->ci", memory.covariance)
    return float(np.mean((values - memory.values) ** 2 / variance))
