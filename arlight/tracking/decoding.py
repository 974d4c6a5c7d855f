"""Encoded values as light and back: by the camera's own curve where it was measured, else by the footage's."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.color import Transfer
from arlight.radiometry import Radiometry
from arlight.video.conversion import TABLE_SIZE, decoding_table, encoding_table

Array = NDArray[np.float64]

_CLIP = 0.94
"""Light from which a pixel counts as clipped where the camera does not say: codecs ring around true white."""
_STEPS = np.linspace(0.0, 1.0, TABLE_SIZE)


@dataclass(frozen=True, slots=True, eq=False)
class Decoding:
    """What a picture's encoded values stand for. Encoded values and light are relative to full scale."""

    light: NDArray[np.float32]
    """(TABLE_SIZE,) light of encoded values evenly from 0 to 1; below 0 where they lie below the camera's black."""
    codes: NDArray[np.float32]
    """(TABLE_SIZE,) encoded values over the SQUARE ROOT of light from 0 to 1, where every curve is smooth."""
    clip: float
    """Light from which a pixel counts as clipped."""

    def linear(self, encoded: ArrayLike) -> Array:
        """Light of encoded values, any shape, clamped to [0, 1]."""
        return np.asarray(np.interp(np.asarray(encoded, float), _STEPS, self.light), float)

    def encoded(self, linear: ArrayLike) -> Array:
        """Encoded values of light, any shape, clamped to [0, 1]."""
        return np.asarray(np.interp(np.sqrt(np.clip(linear, 0.0, 1.0)), _STEPS, self.codes), float)


@lru_cache(maxsize=16)
def decoding(transfer: Transfer, radiometry: Radiometry | None = None) -> Decoding:
    """How a picture is decoded.

    Args:
        transfer: the curve that the footage claims.
        radiometry: the camera's own curve, black and clipping level, which go before it; None where not measured.
    """
    if radiometry is None:
        return Decoding(decoding_table(transfer)[:-1], encoding_table(transfer)[:-1], _CLIP)
    light = radiometry.table(TABLE_SIZE)
    return Decoding(light, np.interp(_STEPS**2, light, _STEPS).astype(np.float32), radiometry.clip)
