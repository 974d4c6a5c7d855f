"""Normal equations of unknowns that many views share, each view's own unknowns eliminated as it is added.

The cost grows with the number of views and not with its cube, and the inverse of what is left is the covariance of
the shared unknowns with all others unknown.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class EliminatedEquations:
    """Gathers views, then solves for a step of everything."""

    def __init__(self, spread: Array, away: Array) -> None:
        """Begin with the prior.

        Args:
            spread: (u,) standard deviations of the shared unknowns.
            away: (u,) how far they are above what is expected.
        """
        self._normal = np.diag(1.0 / spread**2)
        self._right = -away / spread**2
        self._eliminated: list[tuple[Array, Array]] = []

    def add(self, residual: Array, shared: Array, own: Array, precision: Array, spread: Array, away: Array) -> None:
        """Add a view.

        Args:
            residual: (blocks, rows) measured less predicted.
            shared: (blocks, rows, u) change with the shared unknowns; own: (blocks, rows, o) with the view's own.
            precision: (blocks, rows, rows) of the rows.
            spread: (o,) standard deviations of the view's own unknowns; away: (o,) how far they are above what is
                expected.
        """
        weighted, own_weighted = (_flat(precision @ part) for part in (shared, own))
        flat, own = _flat(shared), _flat(own)
        matrix = own.T @ own_weighted + np.diag(1.0 / spread**2)
        right = own_weighted.T @ residual.ravel() - away / spread**2
        cross = weighted.T @ own
        solved = np.asarray(np.linalg.solve(matrix, np.column_stack([cross.T, right])), float)
        self._normal += flat.T @ weighted - cross @ solved[:, :-1]
        self._right += weighted.T @ residual.ravel() - cross @ solved[:, -1]
        self._eliminated.append((solved[:, :-1], solved[:, -1]))

    def solve(self) -> tuple[Array, Array]:
        """Step (u,) of the shared unknowns and their covariance (u, u)."""
        covariance = np.asarray(np.linalg.inv(self._normal), float)
        return covariance @ self._right, covariance

    def own_steps(self, step: Array) -> list[Array]:
        """Step (o,) of each view's own unknowns, in the order they were added, that goes with a shared one (u,)."""
        return [own - cross @ step for cross, own in self._eliminated]


def _flat(rows: Array) -> Array:
    """(blocks * rows, columns) of (blocks, rows, columns)."""
    return rows.reshape(-1, rows.shape[2])
