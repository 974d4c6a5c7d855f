"""The order of light that a scene requires: what the object shows of each order against how well the data tell it.

Light is a sum of independent parts of unit variance, relative to its level, of which the first k make the coefficients
up to an order (a triangular factor of natural light's covariance). What is measured of them are parts z with errors of
covariance C, so the best guess at them and its covariance are

    m = (1 + C)^-1 z,     V = 1 - (1 + C)^-1

What an object shows is linear in the parts; Q is the squared change of the picture. Light shown up to an order K, as it
was measured, is then expected to be wrong by

    error^2(K) = (z_K - m)^T Q (z_K - m) + tr(Q V),     z_K the parts up to K and zeros beyond

Orders that noise drowns make it worse, and what the object or the light has little of makes no difference. Measuring
less saves work, so the lowest order is chosen that costs next to nothing.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.fourier import frequency_order, pack_real, unpack_real

Array = NDArray[np.float64]

_LOOK_EVERY_S = 2.0
"""Time after which all orders are measured once more [s]."""
_JUDGE_EVERY_S = 0.8
"""Time between two frames in which the order is thought over, half of it where a lower one may do [s]."""
_WATCH_EVERY_S = 0.15
"""Time between two frames in which light of a lower order is compared with what it was [s]."""
_OF_STATED = 0.15
"""Share of the stated variance that pictures show. Over the benchmark's clips, whose truth is known, it was 0.1 to 1:
error bars allow for errors that a clip need not have. A share from the low end, because an order that is noise is less
of a loss than one that is missing."""
_UNEVEN = 4.0
"""Mean square of the parts of an order, or toward a lamp, over that of all parts of a light: captured light has up to
twice the amplitude in one order that it has on the whole."""
_STEPS = 8
"""Steps toward the likeliest strength each time that the order is thought over."""
_STANDS_OUT = 4.0
"""Standard deviations by which a frame must show more than usual, or squared errors by which the light must change, for
all orders to be followed again; twice as many after every time that it was in vain."""
_LOWER_AFTER_S = 0.8
"""Time for which a lower order must have sufficed before it is taken [s]."""
_FADE_S = 0.5
"""Time in which orders come and go, so that no frame differs visibly from the last [s]."""
_KEPT = 0.95
"""Of the most that frames showed, from one time that the order is thought over to the next."""
_DARKEST = 1e-3
"""Level below which light is not divided by it [radiance * sr]."""
_WEAKEST = 1e-8
"""Variance of the parts of light that shows none."""
_STEP = 0.5
"""Change of what the followed parts show, relative to its size, with which a light is another one."""


@dataclass(frozen=True, slots=True)
class Need:
    """What of the light is wanted."""

    independent: Array
    """(m, m) lower triangle that makes real-packed coefficients of independent parts."""
    shown: Array
    """(m, m) Q: squared change of what is wanted, as a quadratic form of the parts."""
    tolerance: float
    """Share by which a lower order may raise the error."""


class OrderChoice:
    """Chooses the order to measure and draw in every frame.

    Args:
        frequencies: (k, 2) that the sheet measures, by rising order.
        need: what of the light is wanted.
    """

    def __init__(self, frequencies: NDArray[np.int64], need: Need) -> None:
        order = frequency_order(frequencies)
        self.highest = int(order.max())
        """Order of the sheet."""
        self._tolerance, self._independent = need.tolerance, need.independent
        # of variance 1 in natural light of level 1
        self._parts = np.asarray(np.linalg.inv(need.independent) * need.independent[0, 0])
        # single precision: a choice among a few
        self._shown = need.shown.astype(np.float32)
        self._ends = np.cumsum(np.bincount(np.concatenate([order[:1], np.repeat(order[1:], 2)])))
        self.reset()

    def reset(self) -> None:
        """Forget the light."""
        self.order = self.highest
        """Highest order that is followed."""
        self._core, self._share, self._leaving = self.highest, 1.0, False
        self._learnt_s = -math.inf
        self._left_out = 0.0
        self._model = 1.0, 1.0
        self._doubt = _STANDS_OUT
        self._rose = False
        self._usual = np.zeros(self.highest + 1)
        self._looked_s = self._judged_s = self._watched_s = -math.inf
        self._fits_since_s = math.inf
        self._strength, self._unsure = 0.0, 0.0

    def order_to_measure(self, time_s: float) -> int:
        """Highest order to measure in the frame at a time [s]: the chosen one, now and then all."""
        return self.highest if time_s - self._looked_s >= _LOOK_EVERY_S else self.order

    def learn(self, seen: Lighting, filtered: Lighting, time_s: float) -> None:
        """Take in a frame's own lighting and the filtered one, of the order that was measured or less.

        Not every frame is worth the work.
        """
        self._fade(time_s)
        if len(seen.frequencies) > len(filtered.frequencies):
            self._looked_s = time_s
            self._look(seen)
        if self._share < 1.0 or self._leaving:
            return
        if self.order < self.highest and not 0.0 <= time_s - self._watched_s < _WATCH_EVERY_S:
            self._watched_s = time_s
            self._watch(filtered)
        soon = 0.5 if math.isfinite(self._fits_since_s) else 1.0
        if not 0.0 <= time_s - self._judged_s < soon * _JUDGE_EVERY_S:
            self._judged_s = time_s
            self._judge(seen, filtered, time_s)

    def shown(self, filtered: Lighting) -> Lighting:
        """The filtered lighting, of which orders that come or go are there in part; error bars as they were."""
        if 2 * len(filtered.frequencies) - 1 > self._ends[self.order]:
            filtered = filtered.truncated(self.order)
        first, n = self._ends[self._core], 2 * len(filtered.frequencies) - 1
        if self._share == 1.0 or n <= first:
            return filtered
        packed = pack_real(filtered.coefficients)
        beyond = self._parts[first:n, :n] @ packed / self._independent[0, 0]
        hidden = (1.0 - self._share) * (self._independent[:n, first:n] @ beyond)
        return replace(filtered, coefficients=unpack_real(packed - hidden))

    def _fade(self, time_s: float) -> None:
        """Let the orders beyond the core come or go by what they may since the last frame."""
        step = min(max(time_s - self._learnt_s, 0.0) / _FADE_S, 1.0)
        self._learnt_s = time_s
        self._share = min(max(self._share - step if self._leaving else self._share + step, 0.0), 1.0)
        if self._leaving and self._share == 0.0:
            self.order, self._leaving = self._core, False
        elif not self._leaving and self._share == 1.0:
            self._core = self.order

    def _watch(self, filtered: Lighting) -> None:
        """Follow all orders again if the light is no longer that for which some were left out.

        One frame would hardly tell: what a second of them averages may be far below the noise of each.
        """
        if filtered.order < self.order:
            return
        strength = self._strength_of(filtered)
        change, larger = abs(strength - self._strength), max(strength, self._strength)
        if change > _STEP * larger and change > self._doubt * self._unsure:
            self._rise()

    def _rise(self) -> None:
        """Follow all orders, to be seen little by little."""
        self.order, self._left_out, self._fits_since_s, self._rose = self.highest, 0.0, math.inf, True
        self._share, self._leaving = 0.0, False

    def _look(self, seen: Lighting) -> None:
        """Follow all orders again if one frame shows more of them than any did before they were left out.

        Its errors add to what it shows, but they did so then; what is left out costs `left_out` by now.
        """
        parts, covariance = self._parts_of(seen), self._covariance_of(seen)
        more = self._beyond(parts)[self.order] - self._usual[self.order]
        first, n = self._ends[self.order], len(parts)
        errors = self._shown[first:n, first:n] @ covariance[first:, first:]
        # of a quadratic form of normal errors
        chance = math.sqrt(2.0 * float(np.sum(errors * errors.T)))
        if not self._leaving and more > self._doubt * chance + self._left_out:
            self._rise()

    def _judge(self, seen: Lighting, filtered: Lighting, time_s: float) -> None:
        """Leave orders out when a lower one has sufficed for a while, by what the filter has made of the noise."""
        if len(seen.frequencies) == len(filtered.frequencies):
            self._usual = np.maximum(_KEPT * self._usual, self._beyond(self._parts_of(seen)))
        squared_error = self._squared_errors(filtered)[: self.order + 1]
        most = (1.0 + self._tolerance) ** 2 * squared_error.min() - self._left_out
        lowest = int(np.argmax(squared_error <= most)) if most >= squared_error.min() else self.order
        if lowest >= self.order:
            self._fits_since_s = math.inf
            if self.order == self.highest:
                self._doubt, self._rose = _STANDS_OUT, False
        elif not math.isfinite(self._fits_since_s):
            self._fits_since_s = time_s
        elif time_s - self._fits_since_s >= _LOWER_AFTER_S:
            self._left_out += float(squared_error[lowest] - squared_error.min())
            self._doubt *= 2.0 if self._rose else 1.0
            self._strength, self._unsure = self._strength_of(filtered.truncated(lowest)), float(squared_error.min())
            self._fits_since_s, self._rose = math.inf, False
            self._core, self._share, self._leaving = lowest, 1.0, True

    def _squared_errors(self, filtered: Lighting) -> Array:
        """(order + 1,) expected squared error of what is shown with the light up to an order."""
        parts, stated = self._parts_of(filtered), self._covariance_of(filtered)
        n, uncertain = len(parts), np.float32(_OF_STATED) * stated
        self._model = _likeliest(np.mean(parts**2, axis=1)[1:], np.diag(stated)[1:], *self._model)
        strength = np.float32(_UNEVEN * self._model[0])
        shown, one = self._shown[:n, :n], np.eye(n, dtype=np.float32)
        kept = np.linalg.inv(one + uncertain / strength)
        guess = np.asarray(kept @ parts, np.float32)
        # the level is known, not one of many
        guess[0] = parts[0]
        least = float(strength * np.sum(shown * (one - kept)))
        return (
            np.array([_form(shown, self._up_to(parts, order) - guess) for order in range(filtered.order + 1)]) + least
        )

    def _beyond(self, parts: NDArray[np.float32]) -> Array:
        """(highest + 1,) squared change of what is shown with the parts beyond every order, of those there are."""
        n = len(parts)
        return np.array([_form(self._shown[end:n, end:n], parts[end:]) for end in self._ends])

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

    def _strength_of(self, lighting: Lighting) -> float:
        """Mean square of what is shown with the parts above order 0, one by one."""
        parts = self._parts_of(lighting)[1:]
        return float(np.mean(parts**2, axis=1) @ np.diag(self._shown)[1 : 1 + len(parts)])


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
