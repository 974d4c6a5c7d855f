"""Light that goes back and forth inside the glass before it reaches the paper.

T = (1 - R)/(1 + R) counts all of it as if it came straight. In truth, what the lower face returns is reflected by the
upper face, crosses the film there twice more, and reaches the paper 2 D(w) further on:

    film(p + D) T  ->  (1 - R)^2 sum over k of R^2k film(p + (2k + 1) D) prod over i < k of film(p + (2i + 1) D)^2

The share R^2 matters only near the horizon, where 3 D reaches beyond the block into its neighbours: all crossings but
the last count with the film's mean over the sheet. The coefficients alone do not resolve the horizon either; the change
is small and linear, so it is predicted from them under the prior of natural light.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.layer_series import HARMONICS, convolution
from arlight.estimation.radiance_prior import hemisphere_points, predictor, radiance_covariance, received_operator
from arlight.optics import Slab

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_DIRECTIONS = 1024


def uniform_light(slab: Slab, frequencies: Array) -> Array:
    """(2k - 1,) real-packed coefficients of a uniform sky at frequencies (k, 2), relative to its L~_0."""
    directions, solid_angle = _directions()
    packed = received_operator(slab, frequencies, directions, solid_angle).sum(axis=1)
    return np.asarray(packed / packed[0], float)


def echo_irradiance(film: ComplexArray, cycles: Array, slab: Slab, frequencies: Array) -> ComplexArray:
    """What the round trips change in the irradiance of the paper, per unit coefficient.

    Args:
        film: (blocks, 2 H + 1) harmonics of each block's film.
        cycles: (blocks, 2) frequency of its stripes in the light plane.
        frequencies: (k, 2) frequencies of the coefficients.

    Returns:
        (blocks, 2 H + 1, 2k - 1): harmonics -H..H of the irradiance beyond T times the film's shadow.
    """
    directions, solid_angle = _directions()
    operator = received_operator(slab, frequencies, directions, solid_angle)
    radiance = radiance_covariance(directions, directions) @ predictor(operator, directions)
    cosine = directions[:, 2]
    received = radiance * (solid_angle * cosine * slab.transmittance(cosine))[:, None]
    twice = slab.interface_reflectance(cosine) ** 2
    squared = np.einsum("bml,bl->bm", convolution(film), film)
    far, far_square = (float(np.mean(series[:, HARMONICS].real)) for series in (film, squared))
    straight, echoed = -twice, (1.0 - twice) * twice * far / (1.0 - twice * far_square)
    # blocks share few frequencies and films: the phases of the paper do not matter here
    key = np.round(np.concatenate([film.real, film.imag, cycles], axis=1), 9)
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    harmonics = np.arange(-HARMONICS, HARMONICS + 1)
    change = np.empty((len(first), len(harmonics), received.shape[1]), complex)
    for place, block in enumerate(first):
        wave = np.exp(2j * np.pi * np.outer(harmonics, slab.light_plane(directions) @ cycles[block]))
        kernel = film[block][:, None] * straight + squared[block][:, None] * echoed
        change[place] = (kernel * wave) @ received
    return change[group.ravel()]


def _directions() -> tuple[Array, Array]:
    return hemisphere_points(_DIRECTIONS), np.full(_DIRECTIONS, 2.0 * np.pi / _DIRECTIONS)
