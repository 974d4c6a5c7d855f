"""Refraction, Fresnel and the light plane of a glass slab between film and paper (paper, section 2).

Frames and units: directions are unit vectors toward the light or the viewer in the probe frame (z out of the sheet);
lengths are millimetres; light-plane coordinates are scaled so that the whole hemisphere fills |Delta| <= 1/2.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import ProbeError

Array = NDArray[np.float64]


def interface_reflectance(cos_incidence: ArrayLike, index: float) -> Array:
    """Unpolarised Fresnel reflectance of one air-glass face.

    Args:
        cos_incidence: cosine of the angle in air, any shape, in [0, 1].
        index: refractive index of the glass relative to air, above 1.

    Returns:
        Reflectance in [0, 1], the shape of `cos_incidence`; 1 at grazing incidence.
    """
    cos_air = np.clip(np.asarray(cos_incidence, float), 0.0, 1.0)
    cos_glass = np.sqrt(1.0 - (1.0 - cos_air**2) / index**2)
    s = (cos_air - index * cos_glass) / (cos_air + index * cos_glass)
    p = (index * cos_air - cos_glass) / (index * cos_air + cos_glass)
    return 0.5 * (s**2 + p**2)


@dataclass(frozen=True, slots=True)
class Slab:
    """A pane of glass with the film on its upper face and, below a thin air gap, the paper."""

    glass_mm: float = 2.44
    """Thickness h of the glass [mm]."""
    refractive_index: float = 1.52
    """Refractive index eta of the glass relative to air."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.glass_mm) and self.glass_mm > 0):
            raise ProbeError(f"glass_mm must be a positive thickness in millimetres, found {self.glass_mm}")
        if not (np.isfinite(self.refractive_index) and 1.0 < self.refractive_index <= 4.0):
            raise ProbeError(f"refractive_index must lie in (1, 4], found {self.refractive_index}")

    @property
    def max_offset_mm(self) -> float:
        """Dmax: how far to the side of its crossing of the film a grazing ray meets the paper [mm]."""
        return self.glass_mm / np.sqrt(self.refractive_index**2 - 1.0)

    @property
    def period_mm(self) -> float:
        """P = 2 Dmax: the period on the sheet of frequency (1, 0) [mm]."""
        return 2.0 * self.max_offset_mm

    def offset_mm(self, directions: ArrayLike) -> Array:
        """D(w): where a ray that meets the paper at the origin crosses the film [mm].

        Args:
            directions: unit vectors (..., 3) with z >= 0.

        Returns:
            Offsets (..., 2), pointing toward the light or viewer, at most `max_offset_mm` long.
        """
        w = np.asarray(directions, float)
        tangential = w[..., :2]
        sin_squared = np.sum(tangential**2, axis=-1, keepdims=True)
        # h tan(theta') w_xy/|w_xy| without the division that fails at the normal
        return self.glass_mm * tangential / np.sqrt(self.refractive_index**2 - np.minimum(sin_squared, 1.0))

    def light_plane(self, directions: ArrayLike) -> Array:
        """Delta(w) = D(w) / (2 Dmax): scaled light-plane coordinates (..., 2), at most 1/2 long."""
        return self.offset_mm(directions) / self.period_mm

    def directions(self, light_plane: ArrayLike) -> Array:
        """Unit vectors (..., 3) whose light-plane coordinates are given; inverse of `light_plane`.

        Coordinates outside the disk |Delta| <= 1/2 are answered with the horizon in their direction.
        """
        delta = np.asarray(light_plane, float) * self.period_mm / self.glass_mm
        tan_squared = np.sum(delta**2, axis=-1, keepdims=True)
        tangential = self.refractive_index * delta / np.sqrt(1.0 + tan_squared)
        sine = np.sqrt(np.sum(tangential**2, axis=-1, keepdims=True))
        tangential = tangential / np.maximum(sine, 1.0)
        normal = np.sqrt(np.maximum(0.0, 1.0 - np.minimum(sine, 1.0) ** 2))
        return np.concatenate([tangential, normal], axis=-1)

    def interface_reflectance(self, cos_incidence: ArrayLike) -> Array:
        """Unpolarised Fresnel reflectance of one face of the slab, by the cosine of the angle in air."""
        return interface_reflectance(cos_incidence, self.refractive_index)

    def transmittance(self, cos_incidence: ArrayLike) -> Array:
        """T: incoherent transmittance (1 - R)/(1 + R) of both faces together, by the cosine of the angle in air."""
        face = self.interface_reflectance(cos_incidence)
        return (1.0 - face) / (1.0 + face)

    def projected_solid_angle_density(self, light_plane: ArrayLike) -> Array:
        """d omega^N / dA: projected solid angle per unit of scaled light plane [sr], 0 outside the disk.

        Args:
            light_plane: Delta (..., 2).
        """
        delta = np.asarray(light_plane, float)
        radius_squared = np.sum(delta**2, axis=-1)
        tan_squared = radius_squared * (self.period_mm / self.glass_mm) ** 2
        index_squared = self.refractive_index**2
        density = index_squared / (1.0 + tan_squared) ** 2 * 4.0 / (index_squared - 1.0)
        return np.where(radius_squared <= 0.25, density, 0.0)

    def received_weight(self, light_plane: ArrayLike) -> Array:
        """T d omega^N / dA: what turns radiance l into received lighting l~ [sr]; 0 at the rim and outside."""
        directions = self.directions(light_plane)
        return self.transmittance(directions[..., 2]) * self.projected_solid_angle_density(light_plane)
