"""Light as it is drawn: weighed by how well it is known, with weights that change little by little."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FADE_S = 0.5
"""Time in which weights become others, so that no frame differs visibly from the last [s]."""


class DrawnLight:
    """Passes from one linear map of a light's coefficients to the next.

    Args:
        size: number of real-packed coefficients at most.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self.reset()

    def reset(self) -> None:
        """Draw whatever there is, as it is, until weights are known."""
        self._from = self._to = np.eye(self._size)
        self._share, self._begun = 1.0, False

    @property
    def settled(self) -> bool:
        """Whether the weights stay."""
        return self._share == 1.0

    def pass_to(self, weights: Array) -> None:
        """Make weights (m, m) the next; the first ones hold at once."""
        if self._begun:
            self._from = self._to if self.settled else self._from + self._share * (self._to - self._from)
            self._share = 0.0
        self._to, self._begun = weights, True

    def wait(self, dt: float) -> None:
        """Let the weights change by what they may in a time [s]."""
        self._share = min(self._share + max(dt, 0.0) / _FADE_S, 1.0)

    def weighed(self, packed: Array) -> Array:
        """The first n coefficients (n, c) as they are drawn."""
        n = len(packed)
        last = self._to[:n, :n] @ packed
        return last if self.settled else last + (1.0 - self._share) * (self._from[:n, :n] @ packed - last)
