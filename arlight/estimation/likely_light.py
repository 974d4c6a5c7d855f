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
    covariance: Array
    """(m, m) of the coefficients about that, relative to the squared level and of light of usual strength; none of it
    in the level."""

    @classmethod
    def of_covariance(cls, covariance: Array) -> "LikelyLight":
        """What coefficients of mean 0 and a covariance (m, m) are once their level is known."""
        expected = covariance[:, 0] / covariance[0, 0]
        return cls(expected, covariance / covariance[0, 0] - np.outer(expected, expected))

    def weights(self, errors: Array) -> Array:
        """(n, n) that makes the likeliest coefficients of n measured ones.

        Args:
            errors: (n, n) covariance of the measurement's errors at a level of 1, over the light's strength; those of
                the level are ignored.
        """
        weights, gain, expected = np.eye(len(errors)), self._gain(errors), self.expected[1 : len(errors)]
        weights[1:, 1:] = gain
        weights[1:, 0] = expected - gain @ expected
        return weights

    def posterior(self, errors: Array) -> Array:
        """(n, n) covariance of what the likeliest coefficients are wrong by, on the scale of `covariance`.

        Args:
            errors: as for `weights`.
        """
        n, posterior = len(errors), np.zeros_like(errors)
        prior = self.covariance[1:n, 1:n]
        posterior[1:, 1:] = prior - self._gain(errors) @ prior
        return posterior

    def _gain(self, errors: Array) -> Array:
        """(n - 1, n - 1) S (S + E)^-1: what is kept of a measured distance from what is expected."""
        prior = self.covariance[1 : len(errors), 1 : len(errors)]
        return np.asarray(np.linalg.solve(prior + errors[1:, 1:], prior).T)
