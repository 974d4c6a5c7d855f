"""How a measured quantity lies: its median and how far it scatters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True, slots=True)
class Spread:
    """Median of repeated measurements and the range of most of them."""

    median: float
    """Half of them lie below."""
    low: float
    """A tenth of them lie below."""
    high: float
    """A tenth of them lie above."""
    count: int
    """How many there are."""

    def scaled(self, factor: float) -> "Spread":
        """The same in another unit."""
        return Spread(self.median * factor, self.low * factor, self.high * factor, self.count)


def spread(values: ArrayLike) -> Spread:
    """Median and 10 to 90 % of measurements (n,), n at least 1."""
    measured = np.asarray(values, float)
    low, median, high = np.percentile(measured, [10.0, 50.0, 90.0])
    return Spread(float(median), float(low), float(high), len(measured))


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
