"""What a picture shows of light: errors and strengths of orders as an object, lit by them, makes them seen.

Light varies about what is expected of it with a covariance s S; s, its strength, is found from how strong the
independent parts of isotropic light are. What is measured, z, has errors of covariance E, so what is likeliest, and
drawn, is

    m = mu + S (S + E / s)^-1 (z - mu)

A first one, of light that may come from anywhere, tells where the light comes from; mu and S of just this light make
the second one. What an object shows is linear in the coefficients; Q is the squared change of the picture. Drawn up to
an order K, the light is expected to be wrong by

    error^2(K) = (m_K - m')^T Q (m_K - m') + tr(Q V),     m_K what m up to K makes most probable of isotropic light,

with m' and its covariance V by errors of the size that was found.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.drawn_light import DrawnLight
from arlight.estimation.independent_parts import IndependentParts, level_of
from arlight.estimation.lighting import Lighting
from arlight.estimation.natural_light import PriorKnowledge
from arlight.fourier import frequency_order, pack_real, unpack_real

Array = NDArray[np.float64]

_OF_STATED = 0.15
"""Share of the stated variance that is drawn by. Error bars allow for errors that a clip need not have, and strong
light is missed more than weak; over the benchmark's clips, whose truth is known, half and twice as much make pictures
no better."""
_STEPS = 8
"""Steps toward the likeliest strength each time that the order is thought over."""
_UNSEEN = 0.02
"""Error of a picture that nobody sees, relative to its picture in the light that is expected."""
_WEAKEST = 1e-4
"""Least strength; that of an overcast sky, as even as natural light gets, is ten times as much."""
_LEAST = 1e-8
"""Least share of the stated errors, and what is never divided by less of."""


@dataclass(frozen=True, slots=True)
class Need:
    """What of the light is wanted."""

    independent: Array
    """(m, m) lower triangle that makes real-packed coefficients of independent parts; only the first of these are drawn
    where coefficients are left out."""
    shown: Array
    """(m, m) Q: squared change of what is wanted, as a quadratic form of the real-packed coefficients."""
    tolerance: float
    """Share by which a lower order may raise the error; by as much as nobody sees it may in any case."""


class ShownLight:
    """Light as an object shows it.

    Args:
        prior: what is known of light before it is measured.
        need: what of the light is wanted.
    """

    def __init__(self, prior: PriorKnowledge, need: Need) -> None:
        order = frequency_order(prior.frequencies)
        self.highest = int(order.max())
        """Order of the sheet."""
        self._prior = prior
        self._natural = IndependentParts(need.independent, need.shown)
        self._ends = np.cumsum(np.bincount(np.concatenate([order[:1], np.repeat(order[1:], 2)])))
        self.reset()

    def reset(self) -> None:
        """Forget the light."""
        self._strength, self._errors = 1.0, 1.0
        self._likely = self._prior.isotropic

    def take_in(self, filtered: Lighting) -> None:
        """Learn how strong the light is and where it comes from."""
        squares, stated = self._natural.of(filtered) ** 2, np.diag(self._natural.covariance(filtered))
        self._strength, self._errors = _likeliest(squares.mean(axis=1)[1:], stated[1:], self._strength, self._errors)
        measured, errors = _relative(filtered)
        guess = self._prior.isotropic.weights(_OF_STATED / self._strength * errors) @ measured
        self._likely = self._prior.as_bright_as(guess.mean(axis=1))

    def squared_errors(self, filtered: Lighting) -> Array:
        """(order + 1,) expected squared error of what is drawn of the light up to an order.

        What is likeliest by errors of the size that was found, not of that which is best drawn, stands for the truth.
        """
        measured, errors = _relative(filtered)
        n, relative = len(measured), errors / self._strength
        of_coefficients, shown = self._natural.of_coefficients(n), self._natural.shown[:n, :n]
        # error bars allow for errors that a light need not have
        found = min(self._errors, 1.0) * relative
        truth, drawn = (
            of_coefficients @ (self._likely.weights(each) @ measured) for each in (found, _OF_STATED * relative)
        )
        away = [_form(shown, _up_to(drawn, end) - truth) for end in self._ends[: filtered.order + 1]]
        unknown = of_coefficients @ self._likely.posterior(found) @ of_coefficients.T
        return np.array(away) + self._strength * float(np.sum(shown * unknown))

    @property
    def unseen(self) -> float:
        """Squared error that nobody sees."""
        return _UNSEEN**2 * float(self._natural.shown[0, 0])

    def beyond(self, lighting: Lighting) -> Array:
        """(highest + 1,) squared change of what is shown with the parts beyond every order, of those there are."""
        parts, shown = self._natural.of(lighting), self._natural.shown
        n = len(parts)
        return np.array([_form(shown[end:n, end:n], parts[end:]) for end in self._ends])

    def chance_beyond(self, lighting: Lighting, order: int) -> float:
        """Standard deviation that stated errors give to what is shown beyond an order."""
        first, covariance = self._ends[order], self._natural.covariance(lighting)
        errors = self._natural.shown[first : len(covariance), first : len(covariance)] @ covariance[first:, first:]
        # of a quadratic form of normal errors
        return math.sqrt(2.0 * float(np.sum(errors * errors.T)))

    def strength(self, lighting: Lighting, order: int) -> float:
        """Mean square of what is shown with the parts above order 0 and up to an order, one by one."""
        end = self._ends[order]
        parts, shown = self._natural.of(lighting)[1:end], np.diag(self._natural.shown)[1:end]
        return float(np.vdot(parts, shown[:, None] * parts)) / parts.shape[1]

    def weights(self, filtered: Lighting, order: int) -> Array:
        """(m, m) that make the likeliest real-packed coefficients of measured ones, up to an order and beyond by it."""
        n, errors = int(self._ends[order]), _relative(filtered)[1]
        return self._natural.completing(self._likely.weights(_OF_STATED / self._strength * errors[:n, :n]))

    def drawn(self, lighting: Lighting, drawn: DrawnLight) -> Lighting:
        """A lighting as it is drawn; error bars as they were."""
        return replace(lighting, coefficients=unpack_real(drawn.weighed(pack_real(lighting.coefficients))))


def _relative(lighting: Lighting) -> tuple[Array, Array]:
    """Real-packed coefficients (n, c) of a light and the mean (n, n) of their covariances, of a level of 1."""
    level = level_of(lighting)
    return pack_real(lighting.coefficients) / level, lighting.covariance.mean(axis=0) / level**2


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
        errors = max(errors * math.sqrt(float(twice @ stated) / max(float(once @ stated), _LEAST)), _LEAST)
    return strength, errors


def _up_to(parts: Array, end: int) -> Array:
    return np.where(np.arange(len(parts))[:, None] < end, parts, 0.0)


def _form(matrix: NDArray[np.float32], vectors: NDArray[np.floating]) -> float:
    """x^T A x, mean of the columns x (n, 3) of `vectors`."""
    return float(np.sum(vectors * (matrix @ vectors))) / vectors.shape[1] if len(vectors) else 0.0
