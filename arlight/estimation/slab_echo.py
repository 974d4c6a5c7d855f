"""Light that goes back and forth inside the glass before it reaches the paper.

T = (1 - R)/(1 + R) counts all of it as if it came straight. In truth, what the lower face returns is reflected by the
upper face, crosses the film there twice more, and reaches the paper 2 D(w) further on:

    film(p + D) T  ->  (1 - R)^2 sum over k of R^2k film(p + (2k + 1) D) prod over i < k of film(p + (2i + 1) D)^2

The share R^2 matters only near the horizon, where the coefficients alone do not resolve the light; the difference is
small and linear, so it is predicted from them under the prior of natural light.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.layer_series import HARMONICS
from arlight.estimation.radiance_prior import hemisphere_points, predictor, radiance_covariance, received_operator
from arlight.optics import Slab

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_DIRECTIONS = 1024
_FURTHER_ECHOES = 3
"""Round trips beyond the first are followed this far, through the film's mean."""


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
    # blocks share few films: the phases of the paper do not matter here
    key = np.round(np.concatenate([film.real, film.imag, cycles], axis=1), 9)
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    points = slab.light_plane(directions)
    kernels = np.stack([_kernel(film[i], np.exp(2j * np.pi * points @ cycles[i]), twice) for i in first])
    return np.asarray(kernels @ received, complex)[group.ravel()]


def _kernel(film: ComplexArray, wave: ComplexArray, twice: Array) -> ComplexArray:
    """Harmonics (2 H + 1, n) of the change for received light of unit strength from each direction.

    Args:
        film: (2 H + 1,) harmonics.
        wave: (n,) exp(i 2 pi n.Delta) of the directions; twice: (n,) R^2.
    """
    harmonics = range(-HARMONICS, HARMONICS + 1)
    squared = np.convolve(film, film)[HARMONICS : 3 * HARMONICS + 1]
    powers = {q: wave**q for q in range(-4 * HARMONICS, 4 * HARMONICS + 1)}
    kernel = np.zeros((len(film), len(wave)), complex)
    for j in harmonics:
        if film[HARMONICS + j] == 0.0:
            continue
        kernel[HARMONICS + j] -= twice * film[HARMONICS + j] * powers[j]
        for m in harmonics:
            if abs(j + m) <= HARMONICS:
                share = film[HARMONICS + j] * squared[HARMONICS + m]
                kernel[HARMONICS + j + m] += (1.0 - twice) * twice * share * powers[3 * j + m]
    mean, mean_square = film[HARMONICS], squared[HARMONICS]
    for trips in range(2, _FURTHER_ECHOES + 1):
        kernel[HARMONICS] += (1.0 - twice) * twice**trips * mean * mean_square**trips
    return kernel


def _directions() -> tuple[Array, Array]:
    return hemisphere_points(_DIRECTIONS), np.full(_DIRECTIONS, 2.0 * np.pi / _DIRECTIONS)
