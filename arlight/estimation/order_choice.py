"""The order of light that a scene requires: what the object shows of each order against how well the data tell it.

Light is a sum of independent parts of unit variance, of which the first k make the coefficients up to an order
(a triangular factor of natural light's covariance). What an object shows is linear in them, so leaving out the orders
beyond K costs

    error^2(K) = sum over parts up to K of shown * variance  +  sum over parts beyond K of shown * strength

where `shown` is the squared change of the picture with a part, `variance` how uncertain the part is and `strength` its
square, freed of noise. Measuring less saves work, so the lowest order is chosen that costs next to nothing.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.fourier import frequency_order, pack_real

Array = NDArray[np.float64]

_LOOK_EVERY_S = 1.0
"""Time after which all orders are measured once more [s]."""
_LEARN_EVERY_S = 0.15
"""Time between two frames that are learnt from [s]."""
_VISIBLE = 0.15
"""Share of the stated variance that pictures show: error bars allow for errors that many coefficients have in common,
and in a picture these cancel. Over the clips whose truth is known it was 0.07 to 0.3."""
_STANDS_OUT = 2.0
"""Standard deviations."""
_LOWER_AFTER_S = 0.8
"""Time for which a lower order must have sufficed before it is taken [s]."""
_DARKEST = 1e-3
"""Level below which light is not divided by it [radiance * sr]."""
_STEP = 0.5
"""Change of the chosen parts, relative to their size, that calls for another look at all orders."""


@dataclass(frozen=True, slots=True)
class Need:
    """What of the light is wanted."""

    independent: Array
    """(m, m) lower triangle that makes real-packed coefficients of independent parts."""
    shown: Array
    """(m,) squared change of what is wanted with each part."""
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
        self._need = need
        self._parts = np.linalg.inv(need.independent)
        self._of_order = np.concatenate([order[:1], np.repeat(order[1:], 2)])
        self.reset()

    def reset(self) -> None:
        """Forget the light."""
        self.order = self.highest
        """Highest order that the scene requires."""
        self._lost = np.zeros(self.highest + 1)
        self._unsure = np.zeros(self.highest + 1)
        self._looked_s, self._learnt_s, self._fits_since_s = -math.inf, -math.inf, math.inf
        self._strength = 0.0

    def order_to_measure(self, time_s: float) -> int:
        """Highest order to measure in the frame at a time [s]: the chosen one, now and then all."""
        return self.highest if time_s - self._looked_s >= _LOOK_EVERY_S else self.order

    def learn(self, seen: Lighting, filtered: Lighting, time_s: float) -> None:
        """Take in a frame's own lighting and the filtered one, of the order that was measured or less.

        Between looks at all orders not every frame is worth the work.
        """
        looking = self.order < seen.order == self.highest
        if not looking and 0.0 <= time_s - self._learnt_s < _LEARN_EVERY_S:
            return
        self._learnt_s = time_s
        measured, strength, unsure = self._by_order(seen)
        # what a single frame shows of orders that are not followed counts as far as it stands out of its noise
        chance = _STANDS_OUT * unsure * np.sqrt(2.0 / np.bincount(self._of_order)[: measured + 1])
        self._lost[: measured + 1] = np.maximum(strength - chance, 0.0)
        known, strength, unsure = self._by_order(filtered)
        self._lost[: known + 1], self._unsure[: known + 1] = strength, unsure
        if measured == self.highest:
            self._looked_s = time_s
        # light that changes may have changed beyond the orders that are looked at
        now = float(np.sum(strength[1:]))
        if measured < self.highest and abs(now - self._strength) > _STEP * max(now, self._strength):
            self._looked_s = -math.inf
        if measured == self.highest or self._looked_s == -math.inf:
            self._strength = now
        self._choose(time_s)

    def _by_order(self, lighting: Lighting) -> tuple[int, Array, Array]:
        """Order, and by order what leaving it out would lose and what its uncertainty costs."""
        level = max(float(np.mean(lighting.coefficients[0].real)), _DARKEST)
        packed = pack_real(lighting.coefficients) / level
        n = len(packed)
        shown, to_parts = self._need.shown[:n], self._parts[:n, :n]
        parts = to_parts @ packed
        stated = np.sum(to_parts @ lighting.covariance.mean(axis=0) * to_parts, axis=1) / level**2
        unsure = _VISIBLE * stated * shown
        strength = np.mean(parts**2, axis=1) * shown - unsure
        orders = self._of_order[:n]
        highest = int(orders[-1])
        lost, unsure_by_order = (np.asarray(np.bincount(orders, of, highest + 1), float) for of in (strength, unsure))
        return highest, np.maximum(lost, 0.0), unsure_by_order

    def _choose(self, time_s: float) -> None:
        """Rise at once; fall when a lower order has sufficed for a while, by what the filter has made of the noise."""
        cost = np.sqrt(np.cumsum(self._unsure) + np.concatenate([np.cumsum(self._lost[:0:-1])[::-1], [0.0]]))
        lowest = self._lowest(cost, 0.5 * self._need.tolerance)
        if lowest > self.order and cost[self.order] > (1.0 + self._need.tolerance) * cost.min():
            self.order = lowest
        if lowest >= self.order:
            self._fits_since_s = math.inf
        elif not math.isfinite(self._fits_since_s):
            self._fits_since_s = time_s
        elif time_s - self._fits_since_s >= _LOWER_AFTER_S:
            self.order, self._fits_since_s = lowest, math.inf

    @staticmethod
    def _lowest(cost: Array, tolerance: float) -> int:
        return int(np.flatnonzero(cost <= (1.0 + tolerance) * cost.min())[0])
