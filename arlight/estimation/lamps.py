"""What single blocks mirror beside the smooth reflection: lamps, highlights, a window's edge.

Each block may mirror an extra of its own. It is eliminated from the block's rows, so a block that mirrors a lamp keeps
what the lamp cannot imitate, its harmonics; how large an extra is granted follows the extras that were found.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FREEDOM = 4.0
"""Degrees of freedom of the Student-t distribution of the extras."""


@dataclass(frozen=True, slots=True)
class BesideLamps:
    """Rows of blocks that each mirror an unknown extra."""

    precision: Array
    """(blocks, 7, 7) precision matrices of the rows when the extra is unknown."""
    spread: Array
    """(blocks,) variance with which the extra is known, all else being known."""
    _seen: Array
    """(blocks, 7) how the rows tell of the extra."""

    @classmethod
    def of(cls, precision: Array, mirror: Array, variance: Array) -> "BesideLamps":
        """Eliminate the extras, by Sherman and Morrison.

        Args:
            precision: (blocks, 7, 7) symmetric, of the rows without extra; or (blocks, 7) where they are independent.
            mirror: (blocks, 7) rows of a mirrored extra of 1.
            variance: (blocks,) of the extra before anything is measured.
        """
        matrices = precision if precision.ndim == 3 else _diagonal(precision)
        seen = np.einsum("brs,bs->br", matrices, mirror)
        spread = variance / (1.0 + variance * np.sum(seen * mirror, axis=1))
        return cls(matrices - spread[:, None, None] * seen[:, :, None] * seen[:, None, :], spread, seen)

    def extra(self, missed: Array) -> Array:
        """(blocks,) what each block mirrors, by what the rest of the model misses of its rows (blocks, 7)."""
        return self.spread * np.sum(self._seen * missed, axis=1)

    def granted(self, extra: Array, ordinary: Array) -> Array:
        """(blocks,) variance to grant the extras next, a step of expectation and maximisation.

        Args:
            extra: (blocks,) as found.
            ordinary: (blocks,) variance of the extras of blocks that mirror no lamp.
        """
        return (FREEDOM * ordinary + extra**2 + self.spread) / (FREEDOM + 1.0)


def _diagonal(precision: Array) -> Array:
    """(blocks, 7, 7) matrices of independent rows (blocks, 7)."""
    return precision[:, :, None] * np.eye(precision.shape[1])
