"""Light that the glass returns to the paper: E = E_direct + K (g E), a Neumann series in the bounces.

The lower face returns a share of the paper's light on the spot. What passes it crosses the film, is mirrored by the
upper face, crosses the film again and meets the paper 2 D(w) away.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from arlight.optics import Slab

Image = NDArray[np.float32]


@dataclass(frozen=True)
class Interreflection:
    """Operator from the paper's irradiance to what the glass returns of it."""

    film_squared: Image
    """(rows, columns) transmittance of the film crossed twice at the same point, 0 under the frame. Of dots that are
    finer than the samples this is not the square of what they let through once."""
    paper: Image
    """(rows, columns) reflectance of the paper."""
    slab: Slab
    """The glass."""
    texel_mm: float
    """Distance of neighbouring samples [mm]."""
    directions: int = 96
    """Number of directions into which light returned by the upper face is divided."""

    def total_irradiance(self, direct: Image, bounces: int) -> Image:
        """Irradiance (3, rows, columns) with light returned up to `bounces` times, of the direct irradiance."""
        total = direct
        for _ in range(bounces):
            total = direct + self.returned(total)
        return total

    def returned(self, irradiance: Image) -> Image:
        """Irradiance (3, rows, columns) that comes back once when the paper is lit by `irradiance`."""
        radiosity = np.ascontiguousarray(irradiance * self.paper, dtype=np.float32)
        shifts, weights = self._quadrature
        returned = np.empty_like(radiosity)
        _returned_by_upper_face(radiosity, self.film_squared, shifts, weights, returned)
        return returned + np.float32(diffuse_reflectance(self.slab)) * radiosity

    @cached_property
    def _quadrature(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Whole-texel shifts (n, 2) of row and column to the film's crossing, and each one's share of the light.

        Directions of equal weight on a sunflower spiral: irregular, so that it does not beat with the stripes.
        """
        cosine = (np.arange(20000) + 0.5) / 20000
        face = self.slab.interface_reflectance(cosine)
        # projected solid angle, per azimuth: cos d cos; over pi it is what share of Lambertian light goes there
        density = 2.0 * cosine * face * (1.0 - face) ** 2 / len(cosine)
        cumulative = np.cumsum(density)
        wanted = (np.arange(self.directions) + 0.5) / self.directions * cumulative[-1]
        cosine = np.interp(wanted, cumulative, cosine)
        azimuth = np.arange(self.directions) * np.pi * (3.0 - np.sqrt(5.0))
        sine = np.sqrt(1.0 - cosine**2)
        directions = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)
        shifts = np.rint(self.slab.offset_mm(directions) / self.texel_mm).astype(np.int64)[:, ::-1]
        weights = np.full(self.directions, cumulative[-1] / self.directions, np.float32)
        return np.ascontiguousarray(shifts), weights


def diffuse_reflectance(slab: Slab) -> float:
    """Share of Lambertian light that one face of the glass reflects, 2 integral R cos sin d theta (from the air)."""
    cosine = (np.arange(20000) + 0.5) / 20000
    return float(np.mean(2.0 * cosine * slab.interface_reflectance(cosine)))


@njit(cache=True, nogil=True)
def _returned_by_upper_face(radiosity, film_squared, shifts, weights, out):  # type: ignore[no-untyped-def]
    """out(p) = sum of weight * film(p + D)^2 * radiosity(p + 2 D); the paper beyond the grid is dark."""
    channels, rows, columns = radiosity.shape
    for row in range(rows):
        for channel in range(channels):
            out[channel, row, :] = 0.0
        for k in range(len(weights)):
            film_row, paper_row = row + shifts[k, 0], row + 2 * shifts[k, 0]
            if not (0 <= film_row < rows and 0 <= paper_row < rows):
                continue
            shift, weight = shifts[k, 1], weights[k]
            first, last = max(0, -2 * shift), min(columns, columns - 2 * shift)
            if first >= last:
                continue
            # whole slices: plain loops over them are vectorised
            film = film_squared[film_row, first + shift : last + shift]
            for channel in range(channels):
                lit = radiosity[channel, paper_row, first + 2 * shift : last + 2 * shift]
                target = out[channel, row, first:last]
                for i in range(target.size):
                    target[i] += weight * film[i] * lit[i]
