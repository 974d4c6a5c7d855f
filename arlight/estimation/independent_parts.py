"""Light as a sum of independent parts, of which the first make its coefficients up to an order."""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.fourier import pack_real

Array = NDArray[np.float64]

_DARKEST = 1e-3
"""Level below which light is not divided by it [radiance * sr]."""


def completed(independent: Array, packed: Array) -> Array:
    """All coefficients (m, c) that the first real-packed ones (n, c) make most probable; those stay as they are.

    Args:
        independent: (m, m) lower triangle that makes coefficients of independent parts; the others are taken as 0.
        packed: (n, c) the first coefficients.
    """
    n = len(packed)
    return np.asarray(independent[:, :n] @ np.linalg.solve(independent[:n, :n], packed))


def level_of(lighting: Lighting) -> float:
    """What a light is relative to: L_0, mean of the channels, or next to nothing where that is less [radiance * sr]."""
    levels = lighting.coefficients[0].real
    return max(float(levels.sum()) / len(levels), _DARKEST)


class IndependentParts:
    """Parts of unit variance, relative to the level, which is the first of them.

    Args:
        independent: (m, m) lower triangle that makes real-packed coefficients of parts, up to a factor.
        shown: (m, m) squared change of what is wanted, as a quadratic form of the coefficients.
    """

    def __init__(self, independent: Array, shown: Array) -> None:
        self._independent = independent / independent[0, 0]
        self._of_coefficients = np.asarray(np.linalg.inv(self._independent), float)
        # single precision: for a choice among a few
        self.shown = (self._independent.T @ shown @ self._independent).astype(np.float32)
        """(m, m) squared change of what is wanted, as a quadratic form of the parts."""

    def of_coefficients(self, count: int) -> Array:
        """(n, n) that makes the first parts of the first coefficients."""
        return self._of_coefficients[:count, :count]

    def completing(self, weights: Array) -> Array:
        """(m, m) that makes all coefficients most probable of the first n, weighed by (n, n)."""
        n, all_of_them = len(weights), np.zeros_like(self._independent)
        all_of_them[:, :n] = completed(self._independent, weights)
        return all_of_them

    def of(self, lighting: Lighting) -> NDArray[np.float32]:
        """The parts (n, 3) of a light, relative to its level."""
        packed = pack_real(lighting.coefficients)
        return np.asarray(self.of_coefficients(len(packed)) @ packed / level_of(lighting), np.float32)

    def covariance(self, lighting: Lighting) -> NDArray[np.float32]:
        """Stated covariance (n, n) of the parts, mean of the channels."""
        mean = (lighting.covariance.mean(axis=0) / level_of(lighting) ** 2).astype(np.float32)
        of_them = self.of_coefficients(len(mean)).astype(np.float32)
        return np.asarray(of_them @ mean @ of_them.T)
