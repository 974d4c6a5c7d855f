"""Light as it is likely to be beside what is measured, and what that makes of a measurement."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LikelyLight:
    """A level, which is measured well enough, times what is expected of such light, and what varies about that."""

    expected: Array
    """(m,) real-packed coefficients that are expected of a level of 1."""
    variation: Array
    """(m, m) covariance of the coefficients about that, relative to the squared level; none of it in the level."""

    @classmethod
    def of_covariance(cls, covariance: Array) -> "LikelyLight":
        """What coefficients of mean 0 and a covariance (m, m) are once their level is known."""
        expected = covariance[:, 0] / covariance[0, 0]
        return cls(expected, covariance / covariance[0, 0] - np.outer(expected, expected))

    def weights(self, errors: Array) -> Array:
        """(n, n) that makes the likeliest coefficients of n measured ones.

        Args:
            errors: (n, n) covariance of the measurement relative to that of the light, of a level of 1.
        """
        weights, kept, expected = np.eye(len(errors)), self._kept(errors), self.expected[1 : len(errors)]
        weights[1:, 1:] = kept
        weights[1:, 0] = expected - kept @ expected
        return weights

    def unknown(self, errors: Array) -> Array:
        """(n, n) covariance of what the likeliest coefficients are wrong by, relative to `variation`'s own scale.

        Args:
            errors: as for `weights`.
        """
        n, unknown = len(errors), np.zeros_like(errors)
        varied = self.variation[1:n, 1:n]
        unknown[1:, 1:] = varied - self._kept(errors) @ varied
        return unknown

    def _kept(self, errors: Array) -> Array:
        """(n - 1, n - 1) S (S + E)^-1: what is kept of a measured distance from what is expected."""
        varied = self.variation[1 : len(errors), 1 : len(errors)]
        return np.asarray(np.linalg.solve(varied + errors[1:, 1:], varied).T)
