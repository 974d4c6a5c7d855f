"""What a picture shows of light: errors and strengths of orders as an object, lit by them, makes them seen.

Light is a sum of independent parts of unit variance, relative to its level, of which the first k make the coefficients
up to an order (a triangular factor of natural light's covariance). What is measured of them are parts z with errors of
covariance C, so the best guess at them, which is drawn, and its covariance are

    m = (1 + C)^-1 z,     V = 1 - (1 + C)^-1

What an object shows is linear in the parts; Q is the squared change of the picture. The guess shown up to an order K is
then expected to be wrong by

    error^2(K) = (m_K - m)^T Q (m_K - m) + tr(Q V),     m_K the parts up to K and zeros beyond
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.drawn_light import DrawnLight
from arlight.estimation.lighting import Lighting
from arlight.fourier import frequency_order, pack_real, unpack_real

Array = NDArray[np.float64]

_OF_STATED = 0.07
"""Share of the stated variance that pictures show. Over the benchmark's clips, whose truth is known, it was 0.07 to 1:
error bars allow for errors that a clip need not have. The least of them, because an order that is noise is less of a
loss than one that is missing."""
_UNEVEN = 7.5
"""Mean square of the parts of an order, or toward a lamp, over that of all parts of a light: up to ten in captured
light that comes from the side; over the benchmark's clips half as much costs lamps, twice as much blurred pictures."""
_STEPS = 8
"""Steps toward the likeliest strength each time that the order is thought over."""
_DARKEST = 1e-3
"""Level below which light is not divided by it [radiance * sr]."""
_WEAKEST = 1e-8
"""Variance of the parts of light that shows none."""


@dataclass(frozen=True, slots=True)
class Need:
    """What of the light is wanted."""

    independent: Array
    """(m, m) lower triangle that makes real-packed coefficients of independent parts."""
    shown: Array
    """(m, m) Q: squared change of what is wanted, as a quadratic form of the parts."""
    tolerance: float
    """Share by which a lower order may raise the error."""


class ShownLight:
    """Light as an object shows it.

    Args:
        frequencies: (k, 2) that the sheet measures, by rising order.
        need: what of the light is wanted.
    """

    def __init__(self, frequencies: NDArray[np.int64], need: Need) -> None:
        order = frequency_order(frequencies)
        self.highest = int(order.max())
        """Order of the sheet."""
        self._independent = need.independent
        # of variance 1 in natural light of level 1
        self._parts = np.asarray(np.linalg.inv(need.independent) * need.independent[0, 0])
        # single precision: a choice among a few
        self._shown = need.shown.astype(np.float32)
        self._ends = np.cumsum(np.bincount(np.concatenate([order[:1], np.repeat(order[1:], 2)])))
        self.reset()

    def reset(self) -> None:
        """Forget how strong the light was."""
        self._model = 1.0, 1.0

    def take_in(self, filtered: Lighting) -> None:
        """Learn how strong the light is."""
        parts, stated = self._parts_of(filtered), self._covariance_of(filtered)
        self._model = _likeliest(np.mean(parts**2, axis=1)[1:], np.diag(stated)[1:], *self._model)

    def squared_errors(self, filtered: Lighting) -> Array:
        """(order + 1,) expected squared error of what is shown with the light up to an order, as it was measured."""
        parts, uncertain = self._parts_of(filtered), np.float32(_OF_STATED) * self._covariance_of(filtered)
        n, strength = len(parts), np.float32(self._strength)
        shown, one = self._shown[:n, :n], np.eye(n, dtype=np.float32)
        kept = np.linalg.inv(one + uncertain / strength)
        guess = np.asarray(kept @ parts, np.float32)
        # the level is known, not one of many
        guess[0] = parts[0]
        least = float(strength * np.sum(shown * (one - kept)))
        return (
            np.array([_form(shown, self._up_to(parts, order) - guess) for order in range(filtered.order + 1)]) + least
        )

    def beyond(self, lighting: Lighting) -> Array:
        """(highest + 1,) squared change of what is shown with the parts beyond every order, of those there are."""
        parts = self._parts_of(lighting)
        n = len(parts)
        return np.array([_form(self._shown[end:n, end:n], parts[end:]) for end in self._ends])

    def chance_beyond(self, lighting: Lighting, order: int) -> float:
        """Standard deviation that stated errors give to what is shown beyond an order."""
        first, covariance = self._ends[order], self._covariance_of(lighting)
        errors = self._shown[first : len(covariance), first : len(covariance)] @ covariance[first:, first:]
        # of a quadratic form of normal errors
        return math.sqrt(2.0 * float(np.sum(errors * errors.T)))

    def strength(self, lighting: Lighting, order: int) -> float:
        """Mean square of what is shown with the parts above order 0 and up to an order, one by one."""
        end = self._ends[order]
        parts = self._parts_of(lighting)[1:end]
        return float(np.mean(parts**2, axis=1) @ np.diag(self._shown)[1:end])

    def weights(self, filtered: Lighting, order: int) -> Array:
        """(m, m) that make the likeliest real-packed coefficients of measured ones, up to an order and beyond by it."""
        n, weights = int(self._ends[order]), np.eye(int(self._ends[order]), dtype=np.float32)
        uncertain = self._covariance_of(filtered)[1:n, 1:n] * np.float32(_OF_STATED / self._strength)
        # the level is known, not one of many
        weights[1:, 1:] = np.linalg.inv(weights[1:, 1:] + uncertain)
        to_parts = self._parts[:n].astype(np.float32) / np.float32(self._independent[0, 0])
        return np.asarray(self._independent[:, :n] @ (weights @ to_parts).astype(float))

    def drawn(self, lighting: Lighting, drawn: DrawnLight) -> Lighting:
        """A lighting as it is drawn; error bars as they were."""
        return replace(lighting, coefficients=unpack_real(drawn.weighed(pack_real(lighting.coefficients))))

    @property
    def _strength(self) -> float:
        """Mean square of the strongest parts."""
        return _UNEVEN * self._model[0]

    def _up_to(self, parts: NDArray[np.float32], order: int) -> NDArray[np.float32]:
        kept = parts.copy()
        kept[self._ends[order] :] = 0.0
        return kept

    def _parts_of(self, lighting: Lighting) -> NDArray[np.float32]:
        """(n, 3) parts relative to the level."""
        packed = pack_real(lighting.coefficients)
        n = len(packed)
        return np.asarray(self._parts[:n, :n] @ packed / _level(lighting), np.float32)

    def _covariance_of(self, lighting: Lighting) -> NDArray[np.float32]:
        """(n, n) stated covariance of the parts, mean of the channels."""
        mean = (lighting.covariance.mean(axis=0) / _level(lighting) ** 2).astype(np.float32)
        to_parts = self._parts[: len(mean), : len(mean)].astype(np.float32)
        return np.asarray(to_parts @ mean @ to_parts.T)


def _likeliest(
    squares: NDArray[np.float32], stated: NDArray[np.float32], strength: float, errors: float
) -> tuple[float, float]:
    """Strength of a light's parts and share of the stated errors, as measured squares (n,) of the parts tell them.

    Natural light has as much of one part as of another, and errors grow with the order: of variances strength + errors
    * stated, those are taken under which the squares are most likely. What an order has more of than the lower ones,
    and as its errors have it, is error.

    Source: fixed points of the likelihood's derivatives, as in MacKay 1992, damped by a square root.
    """
    for _ in range(_STEPS if len(squares) else 0):
        total = strength + errors * stated
        once, twice = 1.0 / total, squares / total**2
        strength = max(strength * math.sqrt(float(twice.sum()) / float(once.sum())), _WEAKEST)
        errors *= math.sqrt(float(twice @ stated) / max(float(once @ stated), _WEAKEST))
    return strength, errors


def _form(matrix: NDArray[np.float32], vectors: NDArray[np.float32]) -> float:
    """x^T A x, mean of the columns x (n, 3) of `vectors`."""
    return float(np.sum(vectors * (matrix @ vectors))) / vectors.shape[1] if len(vectors) else 0.0


def _level(lighting: Lighting) -> float:
    return max(float(np.mean(lighting.coefficients[0].real)), _DARKEST)
