"""Temporal filter of the coefficients: a Kalman filter that tells a still light from a moving and a switched one.

Every coefficient moves with a velocity that is driven by white acceleration and dies away (an integrated
Ornstein-Uhlenbeck process). How much acceleration to allow is learnt: innovations that keep pointing the same way say
that the filter lags, innovations that alternate say that it follows noise. That test needs no absolute error scale,
and with dozens of coefficients it answers within a few frames. A frame that none of this can explain is a switch.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.estimation.prior import prior_stddev
from arlight.fourier import pack_real, unpack_real

Array = NDArray[np.float64]

_VELOCITY_LIFE_S = 0.5
"""Time after which a velocity is forgotten unless new frames confirm it [s]."""
_AGITATION_RANGE = (1e-3, 30.0)
"""Least and largest standard deviation of velocity, in prior spreads of the coefficient [1/s]."""
_COASTING_AGITATION = 0.5
"""The same while the sheet is hidden: how fast indoor light may change unseen [1/s]."""
_LEARNING = 1.2
"""Change of the logarithm of agitation by a frame whose innovation fully repeats the last one's."""
_SWITCH = 6.0
"""Innovation, in squared standard deviations, over its usual level, from which a frame is a switch."""
_FORGETTING = 0.9
"""Weight of the past in the innovation's usual level, a frame."""


class LightingFilter:
    """Follows the lighting; `update` with an estimate, or without one while the sheet is hidden."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._lighting: Lighting | None = None
        self._agitation = 0.1
        self._level = 1.0

    def update(self, measured: Lighting | None, time_s: float) -> Lighting | None:
        """The filtered lighting at a frame's time.

        Args:
            measured: the frame's own estimate; None when the sheet was not seen.
            time_s: the frame's time [s]; times must not decrease.

        Returns:
            Coefficients with covariance; None before the first estimate.
        """
        if self._lighting is None:
            if measured is not None:
                self._start(measured)
            return self._lighting
        self._predict(max(time_s - self._lighting.time_s, 0.0), hidden=measured is None)
        if measured is not None:
            self._correct(measured)
        chi2 = float("nan") if measured is None else measured.chi2
        self._lighting = Lighting(
            self._lighting.frequencies, unpack_real(self._position.T), self._pp.copy(), time_s, chi2
        )
        return self._lighting

    def _start(self, measured: Lighting) -> None:
        self._lighting = measured
        self._position = pack_real(measured.coefficients).T
        self._velocity = np.zeros_like(self._position)
        self._pp = measured.covariance.copy()
        self._pv = np.zeros_like(self._pp)
        self._vv = np.zeros_like(self._pp)
        self._diagonal = np.arange(self._position.shape[1])
        self._last_innovation = np.zeros_like(self._position)
        self._spread = self._spreads()
        self._add_to_diagonal(self._vv, (self._agitation * self._spread) ** 2)

    def _spreads(self) -> Array:
        """(3, 2k - 1) natural size of each coefficient, for the light as it is now."""
        assert self._lighting is not None
        irradiance = np.maximum(self._position[:, 0], 1e-3)
        spread = np.stack([prior_stddev(self._lighting.frequencies, level) for level in irradiance])
        spread[:, 0] = 0.35 * irradiance
        return spread

    def _predict(self, dt: float, *, hidden: bool) -> None:
        """Move the state by dt; its covariance as blocks position-position, position-velocity, velocity-velocity."""
        decay = np.exp(-dt / _VELOCITY_LIFE_S)
        reach = _VELOCITY_LIFE_S * (1.0 - decay)
        self._position += reach * self._velocity
        self._velocity *= decay
        cross = self._pv + np.swapaxes(self._pv, 1, 2)
        self._pp += reach * cross + reach**2 * self._vv
        self._pv = decay * (self._pv + reach * self._vv)
        self._vv *= decay**2
        agitation = max(self._agitation, _COASTING_AGITATION) if hidden else self._agitation
        # a process whose velocity has the standard deviation agitation * spread in the long run
        power = (agitation * self._spread) ** 2
        self._add_to_diagonal(self._vv, power * (1.0 - decay**2))
        self._add_to_diagonal(self._pv, power * 0.5 * dt * (1.0 - decay**2))
        self._add_to_diagonal(self._pp, power * dt**2 * (1.0 - decay**2) / 3.0)

    def _correct(self, measured: Lighting) -> None:
        innovation = pack_real(measured.coefficients).T - self._position
        total = self._pp + measured.covariance
        surprise = self._surprise(innovation, total)
        if surprise > _SWITCH * self._level:
            self._restart(measured)
            return
        self._level = _FORGETTING * self._level + (1.0 - _FORGETTING) * surprise
        self._learn(innovation, total)
        gain = np.linalg.solve(total, np.concatenate([self._pp, self._pv], axis=2))
        size = self._position.shape[1]
        change = np.einsum("cij,ci->cj", gain, innovation)
        self._position += change[:, :size]
        self._velocity += change[:, size:]
        to_position, to_velocity = gain[:, :, :size], gain[:, :, size:]
        vv = self._vv - np.swapaxes(self._pv, 1, 2) @ to_velocity
        pv = self._pv - self._pp @ to_velocity
        pp = self._pp - self._pp @ to_position
        self._pp, self._pv, self._vv = _symmetric(pp), pv, _symmetric(vv)
        self._spread = self._spreads()

    def _surprise(self, innovation: Array, total: Array) -> float:
        """Innovation squared over its variance, a coefficient."""
        whitened = np.linalg.solve(total, innovation[..., None])[..., 0]
        return float(np.sum(innovation * whitened) / innovation.size)

    def _learn(self, innovation: Array, total: Array) -> None:
        scale = np.sqrt(np.diagonal(total, axis1=1, axis2=2))
        now, before = innovation / scale, self._last_innovation / scale
        norm = np.sqrt(np.sum(now**2) * np.sum(before**2))
        repeats = float(np.sum(now * before) / norm) if norm > 0.0 else 0.0
        self._agitation = float(np.clip(self._agitation * np.exp(_LEARNING * repeats), *_AGITATION_RANGE))
        self._last_innovation = innovation

    def _restart(self, measured: Lighting) -> None:
        """A switched light: what was known about the old one says nothing about the new one."""
        level = self._level
        self._lighting = None
        self._agitation = max(self._agitation, 0.3)
        self._start(measured)
        self._level = level

    def _add_to_diagonal(self, matrices: Array, values: Array) -> None:
        matrices[:, self._diagonal, self._diagonal] += values


def _symmetric(matrices: Array) -> Array:
    return 0.5 * (matrices + np.swapaxes(matrices, 1, 2))
