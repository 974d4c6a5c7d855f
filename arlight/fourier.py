"""Frequencies of the light plane, analysis and synthesis (paper, section 2.1).

A set of coefficients is a complex array (k, ...) in the order of `half_plane_frequencies`; what is not listed follows
from L_-n = conj(L_n). The same numbers as 2k - 1 real unknowns are (L_0, Re L_1, Im L_1, Re L_2, ...).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import ProbeError

MAX_ORDER = 8


def half_plane_frequencies(order: int) -> NDArray[np.int64]:
    """(0, 0) and the frequencies of the half plane (v > 0, or v = 0 and u > 0) with |n| <= order.

    Args:
        order: 0 to 8.

    Returns:
        (k, 2) integers (u, v), sorted by |n|, then u, then v.
    """
    if not 0 <= order <= MAX_ORDER:
        raise ProbeError(f"order must lie between 0 and {MAX_ORDER}, found {order}")
    span = range(-order, order + 1)
    inside = [(u, v) for u in span for v in span if u * u + v * v <= order * order and (v > 0 or (v == 0 and u >= 0))]
    return np.array(sorted(inside, key=lambda n: (n[0] ** 2 + n[1] ** 2, n[0], n[1])), dtype=np.int64)


def frequency_order(frequencies: ArrayLike) -> NDArray[np.int64]:
    """Order ceil(|n|) of each frequency: (..., 2) integers to (...) integers."""
    n = np.asarray(frequencies, float)
    # integer frequencies: |n|^2 is an integer, so a small slack absorbs the square root's rounding only
    return np.ceil(np.sqrt(np.sum(n**2, axis=-1)) - 1e-9).astype(np.int64)


def orders_up_to(frequencies: ArrayLike, order: int) -> NDArray[np.bool_]:
    """(k,) which of a sheet's frequencies (k, 2) have an order of at most `order`.

    Raises:
        ProbeError: the order is negative or beyond the highest one.
    """
    orders = frequency_order(frequencies)
    if not 0 <= order <= orders.max():
        raise ProbeError(
            f"order {order} was asked for: the sheet measures orders 0 to {orders.max()}; choose among those"
        )
    return orders <= order


def analyse(light: ArrayLike, light_plane: ArrayLike, frequencies: ArrayLike) -> NDArray[np.complex128]:
    """Fourier coefficients of light given as point masses on the light plane.

    L_n = sum over samples of light * exp(-i 2 pi n.Delta), the direct summation of paper, section 2.1.

    Args:
        light: (s, ...) integrated light of each sample (received radiance times area, or any weight).
        light_plane: (s, 2) scaled coordinates Delta.
        frequencies: (k, 2) integers.

    Returns:
        (k, ...) complex coefficients.
    """
    phase = np.asarray(frequencies, float) @ np.asarray(light_plane, float).T
    return np.tensordot(np.exp(-2j * np.pi * phase), np.asarray(light, float), axes=(1, 0))


def synthesise(coefficients: ArrayLike, light_plane: ArrayLike, frequencies: ArrayLike) -> NDArray[np.float64]:
    """Received lighting l~ at points of the light plane, from the coefficients of a half plane.

    Args:
        coefficients: (k, ...) complex.
        light_plane: (s, 2) scaled coordinates Delta.
        frequencies: (k, 2) integers.

    Returns:
        (s, ...) real values: sum over n and -n of L_n exp(i 2 pi n.Delta).
    """
    n = np.asarray(frequencies, float)
    multiplicity = np.where(np.any(n != 0, axis=-1), 2.0, 1.0)
    wave = np.exp(2j * np.pi * (np.asarray(light_plane, float) @ n.T)) * multiplicity
    return np.tensordot(wave, np.asarray(coefficients), axes=(1, 0)).real


def pack_real(coefficients: ArrayLike) -> NDArray[np.float64]:
    """(k, ...) complex coefficients as (2k - 1, ...) real unknowns (L_0, Re L_1, Im L_1, ...)."""
    c = np.asarray(coefficients)
    packed = np.empty((2 * len(c) - 1, *c.shape[1:]))
    packed[0] = c[0].real
    packed[1::2] = c[1:].real
    packed[2::2] = c[1:].imag
    return packed


def unpack_real(packed: ArrayLike) -> NDArray[np.complex128]:
    """(2k - 1, ...) real unknowns as (k, ...) complex coefficients; inverse of `pack_real`."""
    p = np.asarray(packed, float)
    coefficients = np.empty(((len(p) + 1) // 2, *p.shape[1:]), complex)
    coefficients[0] = p[0]
    coefficients[1:] = p[1::2] + 1j * p[2::2]
    return coefficients
