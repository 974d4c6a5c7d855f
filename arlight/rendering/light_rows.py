"""Rows that light multiplies: stored in blocks, coefficient by coefficient, so that fewer coefficients cost less."""

import ctypes
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.native import address, library

Rows = NDArray[np.float32]

_BLOCK = 32
"""Rows of a block, as in light.c."""
_LARGEST = 32767
"""Code of a row's largest value."""
_light = library(__file__, "light", keeps_lock=True).light_rows
_light.restype = None
_light.argtypes = [*[ctypes.c_void_p] * 2, *[ctypes.c_int64] * 2, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p]


class LightRows:
    """Several matrices of rows, stacked; kept in 16 bits, of each row's largest value. Not for two threads at once."""

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
        parts_of = np.eye(stacked.shape[1])
        if independent is not None:
            triangle = np.asarray(independent, float)
            stacked, parts_of = stacked @ triangle.astype(np.float32), np.linalg.inv(triangle)
        blocks, self._count = -(-len(stacked) // _BLOCK), stacked.shape[1]
        # coefficients are taken in units in which they do as much as each other, so that rounding harms none more
        unit = np.sqrt(np.mean(stacked**2, axis=0, dtype=float))
        codes, scale = _coded(stacked / np.maximum(unit, np.finfo(np.float32).tiny).astype(np.float32), blocks)
        self._factors_of = unit[:, None] * parts_of
        self._lit = np.zeros((blocks * _BLOCK, 4), np.float32)
        self._held = codes, scale
        self._rows = (address(codes, np.int16), address(scale, np.float32), blocks, self._count)
        self._lit_address = address(self._lit, np.float32)
        self._last = b""

    def light(self, coefficients: Rows) -> list[Rows]:
        """Rows times coefficients, by the first of them.

        Args:
            coefficients: (k, 3) real-packed, k at most m.

        Returns:
            For each part (n, 4), three colours and 0, a view that holds until the next call.
        """
        given = np.asarray(coefficients)
        if given.ndim != 2 or given.shape[1] != 3 or len(given) > self._count:
            raise ValueError(f"coefficients must be (k, 3), k at most {self._count}, found {given.shape}")
        k = len(given)
        # what was predicted or kept from the last frame is the same light
        content = given.tobytes()
        if content != self._last:
            # the triangle's inverse is one too, and its corner inverts the triangle's corner
            factors = (self._factors_of[:k, :k] @ given).astype(np.float32)
            _light(*self._rows, address(factors, np.float32), k, self._lit_address)
            self._last = content
        starts = [0, *self._ends[:-1]]
        return [self._lit[start:end] for start, end in zip(starts, self._ends, strict=True)]


def _coded(rows: Rows, blocks: int) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
    """Codes (blocks, m, BLOCK) of rows (n, m), and their scales as light.c has them."""
    scale = np.zeros(blocks * _BLOCK, np.float32)
    scale[: len(rows)] = np.abs(rows).max(axis=1) / np.float32(_LARGEST)
    codes = np.zeros((blocks * _BLOCK, rows.shape[1]), np.int16)
    codes[: len(rows)] = np.rint(rows / np.maximum(scale[: len(rows), None], np.finfo(np.float32).tiny))
    # sums of even rows are of the upper half of 32 bits
    apart = scale.reshape(-1, 8, 2) * np.array([2.0**-16, 1.0], np.float32)
    blocked = codes.reshape(blocks, _BLOCK, -1).transpose(0, 2, 1)
    return np.ascontiguousarray(blocked), np.ascontiguousarray(apart.transpose(0, 2, 1))
