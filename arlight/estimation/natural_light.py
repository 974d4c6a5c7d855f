"""Light as it is likely to be, in general and once it is known about where it comes from.

Natural light is a random field of radiance that varies in proportion to how bright it is: a lamp or a window hides more
detail than a wall. Before anything is measured it is isotropic, with the covariance C of `radiance_prior`. With the
brightness b(w) of a first guess of level 1, relative to what is expected from there, it is likely to be the guess
itself, where that is no less than 0, and what varies about it,

    l(w) = level * (guess(w) + max(b(w), b_0)^p * variation(w)),     variation of covariance C, none of it in the level

That the guess was made of the same measurement is left out of account.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.likely_light import LikelyLight
from arlight.estimation.radiance_prior import (
    observed_covariance,
    radiance_covariance,
    received_operator,
    sky_directions,
)
from arlight.optics import Slab

Array = NDArray[np.float64]

_DIRECTIONS = 384
"""Directions that stand for the hemisphere; with twice as many, relit pictures are as far from the truth."""
_DARKEST = 0.1
"""Least brightness b_0 that light varies by: a guess may err toward the dark."""
_SHARPER = 1.5
"""Power p of the guess's brightness, for the guess is blurred."""


class PriorKnowledge(Protocol):
    """What is known of light before it is measured, such as `NaturalLight`."""

    frequencies: NDArray[np.int64]
    """(k, 2) of the coefficients, by rising order."""
    isotropic: LikelyLight
    """Light that may come from anywhere."""

    def as_bright_as(self, guess: Array) -> LikelyLight:
        """Light that is about as bright from everywhere as a guess at its first coefficients (n,), real-packed."""


class NaturalLight:
    """What is known of natural light, as a sheet measures it.

    Args:
        slab: the sheet's glass.
        frequencies: (k, 2) integers, (0, 0) first, by rising order.
    """

    def __init__(self, slab: Slab, frequencies: NDArray[np.int64]) -> None:
        directions, solid_angle_sr = sky_directions(_DIRECTIONS)
        covariance = radiance_covariance(directions, directions)
        self.frequencies = frequencies
        self._operator = received_operator(slab, frequencies, directions, solid_angle_sr)
        self._told = covariance @ self._operator.T
        self._observed = observed_covariance(self._operator @ self._told)
        self.isotropic = LikelyLight.of_covariance(self._observed)
        # single precision, for the largest product: errors are far below the noise that is allowed for
        self._varying, self._covariance = self._operator.astype(np.float32), covariance.astype(np.float32)

    def as_bright_as(self, guess: Array) -> LikelyLight:
        """Light that is about as bright from everywhere as a guess.

        Args:
            guess: (n,) the first real-packed coefficients, of a level of 1; the others are as these make probable.

        Returns:
            Of n coefficients at least; isotropic light where the guess has none.
        """
        n = len(guess)
        radiance = self._told[:, :n] @ np.linalg.solve(self._observed[:n, :n], guess)
        expected = self._told[:, 0] / self._observed[0, 0]
        brightness = np.maximum(radiance / expected, _DARKEST) ** _SHARPER
        varying = self._varying[:n] * brightness.astype(np.float32)
        received = self._operator[:n] @ np.maximum(radiance, 0.0)
        if not received[0] > 0.0:
            return self.isotropic
        covariance = observed_covariance((varying @ self._covariance @ varying.T).astype(float))
        return LikelyLight(received / received[0], LikelyLight.of_covariance(covariance).covariance)
