"""Transfer curves as tables that compiled code interpolates in."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from arlight.color import Transfer, encoded_from_linear, linear_from_encoded

Curve = NDArray[np.float32]
"""Values over [0, 1] in even steps; the last one stands twice, so that there is one after it."""

TABLE_SIZE = 4097
"""Samples of a transfer curve over [0, 1]; linear interpolation between them is good to 1e-6 of full scale."""
IDENTITY: Curve = np.array([0.0, 1.0, 1.0], np.float32)
"""The curve that only clamps."""


@cache
def decoding_table(transfer: Transfer) -> Curve:
    """Linear light over encoded values in [0, 1]."""
    table = linear_from_encoded(np.linspace(0.0, 1.0, TABLE_SIZE), transfer)
    return np.append(table, table[-1:])


@cache
def encoding_table(transfer: Transfer) -> Curve:
    """Encoded values over the SQUARE ROOT of linear light, where every curve is smooth."""
    table = encoded_from_linear(np.linspace(0.0, 1.0, TABLE_SIZE) ** 2, transfer)
    return np.append(table, table[-1:])
