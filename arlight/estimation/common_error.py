"""What averaging over time leaves: errors that neighbouring frames have in common.

Of a frame's error, of covariance R, a share is independent from frame to frame; the rest is common to frames from
nearly the same view and dies away as the view changes. Against its own mean with exponential weights an error c that
dies away exponentially strays by E (c - <c>)^2 = (1 - left) E c^2, and E <c>^2 = left E c^2 is what it leaves in the
mean, however fast it dies away. So nobody needs to know how fast the view changes: what the prediction errors do not
show of R is in the mean.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.memory import FadingMemory

Array = NDArray[np.float64]

_LEARNING_S = 1.0
"""Time over which shares are averaged [s]."""
_NEVER_SHOWN = 0.2
"""Least part of the common error that is left: what no change of view within the memory shows."""
_CHANGE_S = 0.15
"""Time over which prediction errors show that the light has changed [s]."""
_CHANCE = 1.15
"""Prediction errors over the expected ones that mean nothing."""


class CommonError:
    """Learns from the frames how much of their error is independent, and what of the rest several means keep."""

    def __init__(self, memory_s: float, means: int) -> None:
        """Choose over which time [s] the measurements' covariance is averaged, and how many means there are."""
        self._memory_s = memory_s
        self._means = means
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._independent = _Average(1, _LEARNING_S)
        self._shown = _Average(self._means, _LEARNING_S)
        self._lately = _Average(self._means, _CHANGE_S)
        self._averaged = _Average(self._means, _LEARNING_S)

    def start(self, values: Array, covariance: Array) -> None:
        """Another light, seen first as (c, n) with covariance (c, n, n): what is known of the errors is kept."""
        self._recent = [(_judged(values), _judged(np.einsum("cii->ci", covariance)))]
        self._usual, self._weight = covariance, 1.0

    @property
    def independent(self) -> float:
        """Share of a frame's error that is independent of the other frames', in [0, 1]."""
        return min(float(self._independent.value[0]), 1.0)

    def learn(self, values: Array, covariance: Array, means: tuple[FadingMemory, ...], dt: float) -> None:
        """Take in a frame dt [s] after the last, before the means do: (c, n) values with covariance (c, n, n)."""
        variance = _judged(np.einsum("cii->ci", covariance))
        self._typical(covariance, dt)
        self._recent = [*self._recent[-2:], (_judged(values), variance)]
        if len(self._recent) == 3:
            (first, a), (second, b), (third, c) = self._recent
            # light that moves steadily has no second difference
            self._independent.take(np.array([np.mean((third - 2.0 * second + first) ** 2 / (a + 4.0 * b + c))]), dt)
        shown = [np.mean((_judged(values) - _judged(mean.values)) ** 2 / variance) for mean in means]
        averaged = [np.mean(_judged(np.einsum("cii->ci", mean.averaged)) / variance) for mean in means]
        self._shown.take(np.array(shown), dt)
        self._lately.take(np.array(shown), dt)
        self._averaged.take(np.array(averaged), dt)

    def covariance(self, which: int, averaged: Array) -> Array:
        """Covariance (c, n, n) of a mean's error.

        Args:
            which: place of the mean among those that `learn` was given.
            averaged: (c, n, n) its covariance if the errors of all frames were independent.
        """
        independent = self.independent
        expected = independent * (1.0 + float(self._averaged.value[which]))
        shown = float(self._shown.value[which])
        common = 1.0 - independent
        left = float(np.clip(common - (shown - expected), _NEVER_SHOWN * common, common))
        # more shown than a frame can err: the mean lags behind the light, or all error bars are too narrow
        excess = max(float(self._lately.value[which]) - _CHANCE * (expected + common - left), 0.0)
        return np.asarray(independent * averaged + (left + excess) * self._usual, float)

    def _typical(self, covariance: Array, dt: float) -> None:
        """Mean of the frames' covariances; a frame that is less certain counts less."""
        faded = self._weight * float(np.exp(-dt / self._memory_s))
        weight = 1.0 / float(np.mean(np.einsum("cii->ci", covariance) / np.einsum("cii->ci", self._usual)))
        self._usual = (faded * self._usual + weight * covariance) / (faded + weight)
        self._weight = faded + weight


class _Average:
    """An average over the last second or, at first, over all there is."""

    def __init__(self, size: int, memory_s: float) -> None:
        self.value = np.zeros(size)
        self._memory_s = memory_s
        self._count = 0

    def take(self, values: Array, dt: float) -> None:
        self._count += 1
        share = max(1.0 - float(np.exp(-dt / self._memory_s)), 1.0 / self._count)
        self.value = self.value + share * (values - self.value)


def _judged(values: Array) -> Array:
    """The relative coefficients: the level is the exposure's as well."""
    return values[:, 1:] if values.shape[1] > 1 else values
