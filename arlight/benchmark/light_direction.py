"""The direction that the strongest light comes from, read off a set of coefficients."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from arlight.fourier import synthesise
from arlight.optics import Slab

Array = NDArray[np.float64]

# Rec. 709 luminance of linear RGB
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_GRID = 65
_NEWTON_STEPS = 8
# beyond it a step on the light plane is many degrees of elevation: the horizon carries no direction
_MAX_RADIUS = 0.48


def strongest_light(coefficients: NDArray[np.complex128], frequencies: NDArray[np.int64], slab: Slab) -> Array:
    """Where the received lighting that the coefficients synthesise is brightest.

    The same is asked of truth and estimate, with the same frequencies, so that what is compared is how well light
    is followed, not how sharply few coefficients can show it.

    Args:
        coefficients: (k, 3) complex.
        frequencies: (k, 2) integers.
        slab: the glass of the sheet.

    Returns:
        Unit vector (3,), probe frame, toward the light.
    """
    luminance = coefficients @ _LUMINANCE
    grid = _disk()
    peak = grid[np.argmax(synthesise(luminance, grid, frequencies))]
    for _ in range(_NEWTON_STEPS):
        peak = _ascend(peak, luminance, frequencies)
    return slab.directions(peak)


def _ascend(peak: Array, luminance: NDArray[np.complex128], frequencies: NDArray[np.int64]) -> Array:
    """One Newton step up the synthesised light, no longer than a cell of the grid, inside the disk."""
    wave_number = 2.0 * np.pi * frequencies.astype(float)
    wave = luminance * np.exp(1j * wave_number @ peak) * np.where(np.any(frequencies != 0, axis=1), 2.0, 1.0)
    gradient = -wave.imag @ wave_number
    hessian = -np.einsum("k,ki,kj->ij", wave.real, wave_number, wave_number)
    values, vectors = np.linalg.eigh(hessian)
    # away from a maximum the curvature is turned downhill, so that the step still goes up
    curvature = np.maximum(np.abs(values), 1e-9 * max(1e-30, np.abs(values).max()))
    step = vectors @ ((vectors.T @ gradient) / curvature)
    step *= min(1.0, 1.0 / _GRID / max(float(np.linalg.norm(step)), 1e-12))
    moved = peak + step
    return moved * min(1.0, _MAX_RADIUS / max(float(np.linalg.norm(moved)), 1e-12))


@cache
def _disk() -> Array:
    axis = np.linspace(-0.5, 0.5, _GRID)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return points[np.hypot(points[:, 0], points[:, 1]) <= _MAX_RADIUS]
