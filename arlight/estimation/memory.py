"""A Kalman filter with fading memory: what is older than its memory counts less and less, at any frame rate."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class FadingMemory:
    """Averages vectors with their covariances over a memory; with a trend it also follows a steady change.

    Dividing the covariance by exp(-dt/memory) at every step is the Kalman filter whose process noise keeps the balance
    between old and new the same whatever the measurements' covariance is; several channels are filtered at once.
    """

    def __init__(self, memory_s: float, *, trend: bool) -> None:
        """Choose a memory [s] and whether the vectors have a velocity."""
        self._memory_s = memory_s
        self._trend = trend

    def start(self, values: Array, covariance: Array, rate: Array) -> None:
        """Begin with values (c, n), their covariance (c, n, n) and the spread (c, n) of velocities [1/s]."""
        self.values = values.copy()
        self.covariance = covariance.copy()
        self.velocity = np.zeros_like(values)
        self._corrected, self.growth = self.covariance, 1.0
        self._loosened: int | slice = slice(0, 0)
        self._weights = self._squared_weights = 1.0
        self._cross = np.zeros_like(covariance)
        self._moving = np.zeros_like(covariance)
        diagonal = np.arange(values.shape[1])
        self._moving[:, diagonal, diagonal] = rate**2 if self._trend else 0.0

    def predict(self, dt: float, ceiling: Array) -> None:
        """Carry the state on by dt [s]; its variance grows up to `ceiling` (c, n) and no further."""
        growth = float(np.exp(min(dt / self._memory_s, 50.0)))
        self.growth *= growth
        if self._trend:
            self.values += dt * self.velocity
            self.covariance = (
                self.covariance + dt * (self._cross + np.swapaxes(self._cross, 1, 2)) + dt**2 * self._moving
            )
            self._cross = (self._cross + dt * self._moving) * growth
            self._moving = self._moving * growth
        self.covariance = self.covariance * growth
        scale = shrinkage(self.covariance, ceiling)
        if np.all(scale == 1.0):
            return
        # scaling rows and columns keeps the joint matrix positive semidefinite
        self.covariance = self.covariance * scale[:, :, None] * scale[:, None, :]
        self._cross = self._cross * scale[:, :, None] * scale[:, None, :]
        self._moving = self._moving * scale[:, :, None] * scale[:, None, :]

    def loosen(self, place: int, variance: Array) -> None:
        """Grant one element of the vectors a sudden change of variance (c,)."""
        if np.any(variance > 0.0):
            self.covariance[:, place, place] += variance
            self._loosened = place

    def correct(self, values: Array, covariance: Array) -> None:
        """Take in a measurement (c, n) with covariance (c, n, n)."""
        innovation = values - self.values
        total = self.covariance + covariance
        joint = np.concatenate([self.covariance, self._cross], axis=2) if self._trend else self.covariance
        gain = np.linalg.solve(total, joint)
        change = np.einsum("cij,ci->cj", gain, innovation)
        size = values.shape[1]
        to_values = gain[:, :, :size]
        self.values += change[:, :size]
        if self._trend:
            to_velocity = gain[:, :, size:]
            self.velocity += change[:, size:]
            self._moving = _symmetric(self._moving - np.swapaxes(self._cross, 1, 2) @ to_velocity)
            self._cross = self._cross - self.covariance @ to_velocity
        self.covariance = _symmetric(self.covariance - self.covariance @ to_values)
        self._weights = self._weights / self.growth + 1.0
        self._squared_weights = self._squared_weights / self.growth**2 + 1.0
        self._corrected, self.growth = self.covariance, 1.0

    @property
    def averaged(self) -> Array:
        """Covariance (c, n, n) after the last measurement if all errors are independent and nothing changes.

        `covariance` allows for change: of measurements of weight w it is R / sum w, where R sum w^2 / (sum w)^2 is due.
        """
        share = self._squared_weights / self._weights
        # a straight line that fades: 1.25 (1 - fading) R at its end, where `covariance` is 2 (1 - fading) R
        kept = np.sqrt(np.full(self.values.shape[1], min(1.25 * share, 1.0) if self._trend else share))
        kept[self._loosened] = 1.0
        return self._corrected * kept[:, None] * kept


def shrinkage(covariance: Array, ceiling: Array) -> Array:
    """(c, n) factors on the standard deviations of (c, n, n) that keep the variances up to the ceiling (c, n)."""
    variance = np.einsum("cii->ci", covariance)
    return np.sqrt(np.minimum(1.0, ceiling / np.maximum(variance, 1e-30)))


def _symmetric(matrices: Array) -> Array:
    return 0.5 * (matrices + np.swapaxes(matrices, 1, 2))
