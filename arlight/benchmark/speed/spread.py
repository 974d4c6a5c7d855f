"""How a measured quantity lies: its median and how far it scatters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binom

_UNSURE = 0.025


@dataclass(frozen=True, slots=True)
class Spread:
    """Median of repeated measurements and the range of most of them."""

    median: float
    """Half of them lie below."""
    low: float
    """A tenth of them lie below."""
    high: float
    """A tenth of them lie above."""
    least: float
    """What the median of endlessly many would hardly be below: sure to 97.5 %, of fewer than six the smallest one."""
    count: int
    """How many there are."""

    def scaled(self, factor: float) -> "Spread":
        """The same in another unit."""
        return Spread(self.median * factor, self.low * factor, self.high * factor, self.least * factor, self.count)


def spread(values: ArrayLike) -> Spread:
    """Median and 10 to 90 % of measurements (n,), n at least 1."""
    measured = np.sort(np.asarray(values, float))
    low, median, high = np.percentile(measured, [10.0, 50.0, 90.0])
    return Spread(float(median), float(low), float(high), float(measured[_sure_rank(len(measured))]), len(measured))


def _sure_rank(count: int) -> int:
    """Rank from 0 of the value above which the true median lies in 97.5 % of all samples, if there is one.

    Of n values the number below the true median is binomial, (n, 1/2).
    """
    return max(int(binom.ppf(_UNSURE, count, 0.5)) - 1, 0)


def block_means(values: Sequence[float], length: int) -> list[float]:
    """Means of every `length` measurements one after the other; what is left at the end is dropped."""
    count = len(values) // length
    return [float(mean) for mean in np.reshape(values[: count * length], (count, length)).mean(axis=1)]


def paired_ratio(measured: Sequence[float], yardstick: Sequence[float]) -> Spread:
    """Ratios of measurements made in turns, each with its own neighbour: what slows both cancels.

    Args:
        measured: (n,) one kind.
        yardstick: (n,) the other kind, positive, measured right beside.
    """
    return spread(np.asarray(measured, float) / np.asarray(yardstick, float))
