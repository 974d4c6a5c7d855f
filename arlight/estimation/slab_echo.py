"""Light that goes back and forth inside the glass before it reaches the paper.

T = (1 - R)/(1 + R) counts all of it as if it came straight. In truth, what the lower face returns is reflected by the
upper face, crosses the film there twice more, and reaches the paper 2 D(w) further on:

    film(p + D) T  ->  (1 - R)^2 sum over k of R^2k film(p + (2k + 1) D) prod over i < k of film(p + (2i + 1) D)^2

The share R^2 matters only near the horizon, where 3 D reaches beyond the block into its neighbours: all crossings but
the last count with the film's mean over the sheet. The coefficients alone do not resolve the horizon either; the change
is small and linear, so it is predicted from them under the prior of natural light.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.layer_series import HARMONICS, convolution
from arlight.estimation.radiance_prior import predicted_sky, received_operator, sky_directions
from arlight.optics import Slab

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def uniform_light(slab: Slab, frequencies: Array) -> Array:
    """(2k - 1,) real-packed coefficients of a uniform sky at frequencies (k, 2), relative to its L~_0."""
    directions, solid_angle = sky_directions()
    packed = received_operator(slab, frequencies, directions, solid_angle).sum(axis=1)
    return np.asarray(packed / packed[0], float)


@dataclass(frozen=True, slots=True)
class Echo:
    """What the round trips change in the irradiance of the paper; many blocks share it."""

    irradiance: ComplexArray
    """(kinds, 2 H + 1, 2k - 1): harmonics -H..H beyond T times the film's shadow, for unit real-packed coefficients."""
    kind: NDArray[np.int64]
    """(blocks,) which of them is each block's."""


def echo_irradiance(film: ComplexArray, cycles: Array, slab: Slab, frequencies: Array) -> Echo:
    """What the round trips change in the irradiance of the paper, per unit coefficient.

    Args:
        film: (blocks, 2 H + 1) harmonics of each block's film.
        cycles: (blocks, 2) frequency of its stripes in the light plane.
        frequencies: (k, 2) frequencies of the coefficients.
    """
    directions, solid_angle = sky_directions()
    radiance = predicted_sky(slab, frequencies)
    cosine = directions[:, 2]
    received = radiance * (solid_angle * cosine * slab.transmittance(cosine))[:, None]
    twice = slab.interface_reflectance(cosine) ** 2
    squared = np.einsum("bml,bl->bm", convolution(film), film)
    far, far_square = (float(np.mean(series[:, HARMONICS].real)) for series in (film, squared))
    straight, echoed = -twice, (1.0 - twice) * twice * far / (1.0 - twice * far_square)
    # blocks share few frequencies and films: the phases of the paper do not matter here
    key = np.round(np.concatenate([film.real, film.imag, cycles], axis=1), 9)
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    kernel = film[first][:, :, None] * straight + squared[first][:, :, None] * echoed
    phase = 2.0 * np.pi * np.multiply.outer(cycles[first] @ slab.light_plane(directions).T, np.arange(HARMONICS + 1))
    upper = kernel[:, HARMONICS:] * np.exp(1j * np.swapaxes(phase, 1, 2))
    # of a real function the other harmonics are the conjugates
    change = upper.real @ received + 1j * (upper.imag @ received)
    change = np.concatenate([np.conj(change[:, :0:-1]), change], axis=1)
    return Echo(change, group.ravel())
