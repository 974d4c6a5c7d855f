"""Light as a sum of independent parts, of which the first make its coefficients up to an order."""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.fourier import pack_real

Array = NDArray[np.float64]

_DARKEST = 1e-3
"""Level below which light is not divided by it [radiance * sr]."""


class IndependentParts:
    """Parts of unit variance, relative to the level, which is the first of them.

    Args:
        independent: (m, m) lower triangle that makes real-packed coefficients of parts, up to a factor.
        shown: (m, m) squared change of what is wanted, as a quadratic form of the coefficients.
    """

    def __init__(self, independent: Array, shown: Array) -> None:
        self.coefficients = independent / independent[0, 0]
        """(m, m) of a light of level 1 that each part makes."""
        self._of_coefficients = np.asarray(np.linalg.inv(self.coefficients), float)
        # single precision: for a choice among a few
        self.shown = (self.coefficients.T @ shown @ self.coefficients).astype(np.float32)
        """(m, m) squared change of what is wanted, as a quadratic form of the parts."""

    def told(self, count: int) -> Array:
        """(n, n) that makes the first parts of the first coefficients."""
        return self._of_coefficients[:count, :count]

    def completed(self, count: int) -> Array:
        """(m, n) that makes of the first coefficients all that they make most probable."""
        return self.coefficients[:, :count] @ self.told(count)

    def of(self, lighting: Lighting) -> NDArray[np.float32]:
        """The parts (n, 3) of a light, relative to its level."""
        packed = pack_real(lighting.coefficients)
        return np.asarray(self.told(len(packed)) @ packed / level_of(lighting), np.float32)

    def covariance(self, lighting: Lighting) -> NDArray[np.float32]:
        """Stated covariance (n, n) of the parts, mean of the channels."""
        mean = (lighting.covariance.mean(axis=0) / level_of(lighting) ** 2).astype(np.float32)
        told = self.told(len(mean)).astype(np.float32)
        return np.asarray(told @ mean @ told.T)


def level_of(lighting: Lighting) -> float:
    """What a light is relative to: L_0, mean of the channels [radiance * sr]."""
    levels = lighting.coefficients[0].real
    return max(float(levels.sum()) / len(levels), _DARKEST)
