"""The direction that the strongest light comes from, read off a set of coefficients."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from arlight.fourier import synthesise
from arlight.optics import Slab

Array = NDArray[np.float64]

# Rec. 709 luminance of linear RGB
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_GRID = 97
_LEVEL = 0.5


def strongest_light(coefficients: NDArray[np.complex128], frequencies: NDArray[np.int64], slab: Slab) -> Array:
    """Where the brightest lobe of the received lighting that the coefficients synthesise lies.

    The lobe is what is connected with the brightest point and above half of it; its place is the centroid on the light
    plane, weighted by what exceeds the half. The brightest point itself is ill-defined in soft light, where an error of
    a per cent moves it by many degrees. The same is asked of truth and estimate, with the same frequencies, so that
    what is compared is how well light is followed, not how sharply few coefficients can show it.

    Args:
        coefficients: (k, 3) complex.
        frequencies: (k, 2) integers.
        slab: the glass of the sheet.

    Returns:
        Unit vector (3,), probe frame, toward the light; the zenith where there is no light.
    """
    points, inside = _disk()
    light = np.where(inside, synthesise(coefficients @ _LUMINANCE, points, frequencies), 0.0)
    brightest = int(np.argmax(light))
    excess = np.maximum(light - _LEVEL * light[brightest], 0.0)
    lobes, _ = label(excess.reshape(_GRID, _GRID) > 0.0)
    lobe = np.where(lobes.ravel() == lobes.ravel()[brightest], excess, 0.0)
    total = lobe.sum()
    return slab.directions(lobe @ points / total if total > 0.0 else np.zeros(2))


@cache
def _disk() -> tuple[Array, NDArray[np.bool_]]:
    """Points (n, 2) of a square grid over the light plane, row by row, and which lie in the disk."""
    axis = (np.arange(_GRID) + 0.5) / _GRID - 0.5
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return points, np.hypot(points[:, 0], points[:, 1]) <= 0.5
