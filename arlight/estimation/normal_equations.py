"""Weighted normal equations of blocks that share L_0 and a reflection field but have a frequency of their own.

Row r of block i reads  d_r0 L_0 + d_r1 Re L_n(i) + d_r2 Im L_n(i) + ... + mirror_r * (basis_i . w): of the unknown
(L_0, Re L_1, ..., w) it touches three or five coefficients and the field, so nothing of full width is ever multiplied.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Beside:
    """Normal equations of m further unknowns once the system's own have been solved for."""

    information: Array
    """(m, m) information about them, the system's unknowns being free."""
    right: Array
    """(m,) right-hand side."""
    carried: Array
    """(c + s, m) how much the system's solution moves against each of them."""


class BlockSystem:
    """Gathers and solves the equations of one channel."""

    def __init__(self, places: NDArray[np.int64], basis: Array, expected: Array, deviation: Array) -> None:
        """Fix what does not change while weights are iterated.

        Args:
            places: (blocks, c) real-packed place of each column of a block's rows; 0 where its column is 0.
            basis: (blocks, s) of the reflection field.
            expected: (c + s,) prior mean of all unknown; deviation: (c + s,) its standard deviation.
        """
        self._basis = basis
        self._prior = 1.0 / deviation**2
        self._expected = expected
        self._coefficients = len(deviation) - basis.shape[1]
        self.field_size = basis.shape[1]
        self._places = places

    def solve(self, design: Array, mirror: Array, values: Array, precision: Array) -> tuple[Array, Array]:
        """Solution (c + s,) and normal matrix (c + s, c + s) including the prior.

        Args:
            design: (blocks, rows, c); mirror, values: (blocks, rows); precision: (blocks, rows, rows).
        """
        c, places, basis = self._coefficients, self._places, self._basis
        # one right-hand product a block: rows of the coefficients, of the field and of the values
        n = places.shape[1]
        wide = np.concatenate([design, mirror[..., None], values[..., None]], axis=2)
        products = np.swapaxes(wide, 1, 2) @ (precision @ wide)
        normal = np.zeros((len(self._prior), len(self._prior)))
        np.add.at(normal, (places[:, :, None], places[:, None, :]), products[:, :n, :n])
        cross = np.zeros((c, basis.shape[1]))
        np.add.at(cross, places.ravel(), (products[:, :n, n : n + 1] * basis[:, None, :]).reshape(-1, basis.shape[1]))
        normal[:c, c:] = cross
        normal[c:, :c] = cross.T
        normal[c:, c:] = (basis * products[:, n, n][:, None]).T @ basis
        right = np.zeros(len(self._prior))
        np.add.at(right, places, products[:, :n, n + 1])
        right[c:] = products[:, n, n + 1] @ basis
        normal[np.diag_indices_from(normal)] += self._prior
        right += self._prior * self._expected
        return np.asarray(np.linalg.solve(normal, right), float), normal

    def beside(
        self, normal: Array, design: Array, mirror: Array, precision: Array, slopes: Array, missed: Array
    ) -> Beside:
        """Equations of unknowns that change the rows by slopes (blocks, rows, m); missed: (blocks, rows) residuals."""
        weighted = precision @ slopes
        cross = np.zeros((len(normal), slopes.shape[2]))
        np.add.at(cross, self._places, np.swapaxes(design, 1, 2) @ weighted)
        cross[self._coefficients :] = self._basis.T @ np.einsum("br,brm->bm", mirror, weighted)
        carried = np.asarray(np.linalg.solve(normal, cross), float)
        information = np.einsum("brk,brm->km", slopes, weighted) - cross.T @ carried
        return Beside(information, np.einsum("brk,br->k", weighted, missed), carried)

    def explained(self, covariance: Array, design: Array, mirror: Array, precision: Array) -> Array:
        """(blocks, rows, rows) part of each block's precision that the fit uses up: P A C A' P.

        Args:
            covariance: (c + s, c + s) of the unknown; the rest as in `solve`.
        """
        field = self._coefficients + np.arange(self.field_size)
        unknown = np.concatenate([self._places, np.broadcast_to(field, (len(self._places), len(field)))], axis=1)
        wide = np.concatenate([design, mirror[:, :, None] * self._basis[:, None, :]], axis=2)
        weighted = precision @ wide
        own = covariance[unknown[:, :, None], unknown[:, None, :]]
        return np.asarray(weighted @ own @ np.swapaxes(weighted, 1, 2), float)

    def field(self, solution: Array) -> Array:
        """Reflection field (blocks,) of a solution."""
        return self._basis @ solution[self._coefficients :]

    def lit(self, solution: Array, design: Array) -> Array:
        """Rows (blocks, rows) that the lighting alone predicts."""
        return np.einsum("brk,bk->br", design, solution[self._places])
