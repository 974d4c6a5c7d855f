"""Rows that light multiplies: stored coefficient by coefficient, so that fewer coefficients cost less."""

import ctypes
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.native import address, library

Rows = NDArray[np.float32]

_light = library(__file__, "light").light_rows
_light.restype = None
_light.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p]


class LightRows:
    """Several matrices of rows, stacked. Not for two threads at once."""

    def __init__(self, parts: Sequence[ArrayLike], independent: ArrayLike | None = None) -> None:
        """Stack matrices.

        Args:
            parts: matrices (n, m) of the same m coefficients.
            independent: (m, m) lower triangle that makes coefficients of independent parts, as `Reconstruction` has it:
                coefficients that are not given are then predicted by those that are. Without it they are zero.
        """
        matrices = [np.asarray(part, np.float32) for part in parts]
        self._ends = np.cumsum([len(matrix) for matrix in matrices]).tolist()
        stacked = np.concatenate(matrices)
        self._parts_of: NDArray[np.float64] | None = None
        if independent is not None:
            triangle = np.asarray(independent, float)
            stacked, self._parts_of = stacked @ triangle.astype(np.float32), np.linalg.inv(triangle)
        self._rows = np.ascontiguousarray(stacked.T)
        self._lit = np.empty((3, self._ends[-1]), np.float32)
        self._rows_address, self._lit_address = (address(array, np.float32) for array in (self._rows, self._lit))

    def light(self, coefficients: Rows) -> list[Rows]:
        """Rows times coefficients, by the first of them.

        Args:
            coefficients: (k, 3) real-packed, k at most m.

        Returns:
            For each part (3, n), a view that holds until the next call.
        """
        given = np.asarray(coefficients)
        if given.ndim != 2 or given.shape[1] != 3 or len(given) > len(self._rows):
            raise ValueError(f"coefficients must be (k, 3), k at most {len(self._rows)}, found {given.shape}")
        k = len(given)
        # the triangle's inverse is one too, and its corner inverts the triangle's corner
        known = given if self._parts_of is None else self._parts_of[:k, :k] @ given
        factors = np.ascontiguousarray(known, np.float32)
        total = self._lit.shape[1]
        _light(self._rows_address, total, address(factors, np.float32), k, self._lit_address)
        starts = [0, *self._ends[:-1]]
        return [self._lit[:, start:end] for start, end in zip(starts, self._ends, strict=True)]
