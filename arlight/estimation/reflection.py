"""The mirror reflection in the film, as a smooth random field over the sheet.

The film mirrors the environment, and neighbouring blocks mirror neighbouring directions. The field's prior is a
Matern-3/2 process over the sheet, written in its leading eigenvectors: a few dozen numbers of known variance a channel.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.native import address, library

Array = NDArray[np.float64]

_LENGTH_MM = 40.0
"""Correlation length: about 8 degrees of mirrored environment at arm's length [mm]."""
_KEPT_VARIANCE = 3e-3
_native = library(__file__, "sheet_estimate")
_native.amplitude_of_field.restype = ctypes.c_double
_native.amplitude_of_field.argtypes = (ctypes.c_void_p, ctypes.c_int64, ctypes.c_double)


def reflection_basis(centers_mm: Array) -> Array:
    """Basis (blocks, k): a constant, then fields whose amplitudes are independent with unit variance, smoothest first.

    Args:
        centers_mm: (blocks, 2) centres of the blocks [mm].
    """
    distance = np.linalg.norm(centers_mm[:, None] - centers_mm[None], axis=-1)
    scaled = np.sqrt(3.0) * distance / _LENGTH_MM
    values, vectors = np.linalg.eigh((1.0 + scaled) * np.exp(-scaled))
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = values > _KEPT_VARIANCE * values[0]
    return np.concatenate([np.ones((len(centers_mm), 1)), vectors[:, kept] * np.sqrt(values[kept])], axis=1)


def field_amplitude(observed: Array, floor: float) -> float:
    """Standard deviation of the field, from what the black regions mirror.

    A bright patch is mirrored in few of them; a deviation that ignored it would let the patch pass for light. A lamp
    counts as such a patch and no more.

    Args:
        observed: (n,) means of black regions.
        floor: least standard deviation.
    """
    values = np.array(observed, np.float64)
    return float(_native.amplitude_of_field(address(values, np.float64), len(values), floor))
