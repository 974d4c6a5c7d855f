"""Light that goes back and forth inside the glass before it reaches the paper.

What the lower face returns is reflected by the upper face, where it crosses the film twice more, and reaches the paper
2 D(w) further on. Of light w, beside the (1 - R)^2 film(p + D) that comes straight, a point p of the paper gets

    (1 - R)^2 [ R^2 film(p + 3D) film(p + D)^2 + R^4 film(p + 5D) film(p + 3D)^2 film(p + D)^2 + ... ]

R^2 is 0.4 % at 50 degrees off the normal, 3 % at 70 and 15 % at 80. A product of films is no correlation, so it is
summed light by light, over groups of lights. Three and more round trips are left out: R^6 is 0.4 % at 80 degrees.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from arlight.optics import Slab
from arlight.synthetic.light_groups import group_lights

Array = NDArray[np.float64]
Image = NDArray[np.float32]


@dataclass(frozen=True)
class SlabEchoes:
    """Turns distant lights into what reaches the paper after one or more round trips in the glass."""

    film: Image
    """(rows, columns) transmittance of the film, 0 under the frame and taken as 0 beyond."""
    film_squared: Image
    """(rows, columns) transmittance of the film crossed twice at the same point."""
    slab: Slab
    """The glass."""
    texel_mm: float
    """Distance of neighbouring samples, row 0 toward +y [mm]."""
    groups: int = 256
    """Number of directions into which the lights are gathered."""

    def irradiance(self, directions: Array, light: Array) -> Image:
        """Irradiance (3, rows, columns) [radiance * sr]; linear in the light up to how it is gathered.

        Args:
            directions: (n, 3) unit vectors toward the lights.
            light: (n, 3) radiance times solid angle.
        """
        cosine = directions[:, 2]
        face = self.slab.interface_reflectance(cosine)
        strengths = light * (cosine * (1.0 - face) ** 2 * face**2)[:, None]
        gathered = group_lights(self.slab.offset_mm(directions), strengths, self.groups)
        mass = strengths.sum(axis=1)
        again = [np.average(face[members] ** 2, weights=mass[members]) for members in gathered.members]
        out = np.zeros((3, *self.film.shape), np.float32)
        # rows run toward -y; every trip begins two D further on
        offset = gathered.positions[:, ::-1] * [-1.0, 1.0] / self.texel_mm
        near, near_taps = _cubic(offset)
        far, far_taps = _cubic(3.0 * offset)
        _gather(
            *self._padded,
            np.stack([near, far, np.rint(3.0 * offset).astype(np.int64), np.rint(5.0 * offset).astype(np.int64)]),
            np.stack([near_taps, far_taps]),
            gathered.strengths.astype(np.float32),
            np.array(again, np.float32),
            self._reach,
            out,
        )
        return out

    @cached_property
    def _reach(self) -> int:
        """Texels that the farthest crossing followed, 5 D, and its taps may lie outside."""
        return int(np.ceil(5.0 * self.slab.max_offset_mm / self.texel_mm)) + 3

    @cached_property
    def _padded(self) -> tuple[Image, Image]:
        film, squared = (np.pad(layer, self._reach).astype(np.float32) for layer in (self.film, self.film_squared))
        return film, squared


def _cubic(offset: Array) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Catmull and Rom's interpolation: first of four texels (n, 2) and their weights (n, 2, 4) along each axis.

    Half a texel from the samples it keeps 99.3 % of a stripe of nine texels, the finest of order 5; linear keeps 93 %.
    """
    whole = np.floor(offset)
    t = offset - whole
    weights = [((2 - t) * t - 1) * t, (3 * t - 5) * t**2 + 2, ((4 - 3 * t) * t + 1) * t, (t - 1) * t**2]
    return whole.astype(np.int64) - 1, (0.5 * np.stack(weights, axis=-1)).astype(np.float32)


@njit(cache=True, nogil=True)
def _shifted(image, row, column, taps, mixed, out):  # type: ignore[no-untyped-def]
    """A row of an image at a place between its texels, whose first of four taps is (row, column)."""
    width = mixed.size
    for k in range(4):
        source = image[row + k, column : column + width]
        weight = taps[0, k]
        if k == 0:
            for i in range(width):
                mixed[i] = weight * source[i]
        else:
            for i in range(width):
                mixed[i] += weight * source[i]
    a, b, c, d = taps[1, 0], taps[1, 1], taps[1, 2], taps[1, 3]
    for i in range(out.size):
        out[i] = a * mixed[i] + b * mixed[i + 1] + c * mixed[i + 2] + d * mixed[i + 3]


@njit(cache=True, nogil=True)
def _gather(film, squared, places, taps, strengths, again, reach, out):  # type: ignore[no-untyped-def]
    """out += strength * squared(p + D) * [film(p + 3D) + R^2 squared(p + 3D) film(p + 5D)], R^2 being `again`.

    The second of these is a tenth of the first: it is taken from the nearest texel.
    """
    channels, rows, columns = out.shape
    mixed = np.empty(columns + 3, np.float32)
    near = np.empty(columns, np.float32)
    far = np.empty(columns, np.float32)
    for row in range(rows):
        middle = row + reach
        for g in range(len(strengths)):
            _shifted(squared, middle + places[0, g, 0], reach + places[0, g, 1], taps[0, g], mixed, near)
            _shifted(film, middle + places[1, g, 0], reach + places[1, g, 1], taps[1, g], mixed, far)
            first, last = reach + places[2, g, 1], reach + places[3, g, 1]
            twice = squared[middle + places[2, g, 0], first : first + columns]
            farthest = film[middle + places[3, g, 0], last : last + columns]
            for i in range(columns):
                near[i] *= far[i] + again[g] * twice[i] * farthest[i]
            for channel in range(channels):
                strength = strengths[g, channel]
                target = out[channel, row]
                for i in range(columns):
                    target[i] += strength * near[i]
