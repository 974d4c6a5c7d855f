"""What light is for: objects of several finishes, lit by a map of radiance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.calibration.ball.mirror_ball import MapGrid
from arlight.estimation.radiance_prior import hemisphere_points

Array = NDArray[np.float64]
FloatArray = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Material:
    """How an object's surface gathers light."""

    name: str
    """In words."""
    roughness: float | None
    """Of a glossy lobe about the mirror direction, square root of the GGX width; 0: mirror; None: matte."""
    on_screen: bool = False
    """Judged as a picture shows it, everything above full scale white, rather than by its light."""

    def kernel(self, toward: ArrayLike, grid: MapGrid) -> FloatArray:
        """(n, texels) weights of the map's texels for surfaces that face, or mirror, directions (n, 3).

        A matte surface gathers irradiance, a mirror one texel; a lobe's weights sum to 1 over the sphere.
        """
        if self.roughness == 0.0:
            return _texel_choice(toward, grid)
        light = grid.directions().reshape(-1, 3).astype(np.float32)
        solid_angle = np.broadcast_to(grid.solid_angle_sr, (grid.rows, 2 * grid.rows)).ravel().astype(np.float32)
        cosine = np.asarray(toward, np.float32) @ light.T
        if self.roughness is None:
            return np.maximum(cosine, 0.0) * solid_angle
        spread = (1.0 + cosine) / 2.0 * np.float32(self.roughness**4 - 1.0) + np.float32(1.0)
        weight = np.maximum(cosine, 0.0) / spread**2 * solid_angle
        return weight / weight.sum(axis=1, keepdims=True)


def _texel_choice(toward: ArrayLike, grid: MapGrid) -> FloatArray:
    """(n, texels) 1 at the texel of each direction."""
    w = np.asarray(toward, float)
    row = np.clip((np.arccos(np.clip(w[:, 2], -1.0, 1.0)) / np.pi * grid.rows).astype(int), 0, grid.rows - 1)
    column = np.floor(np.arctan2(w[:, 1], w[:, 0]) / np.pi * grid.rows).astype(int) % (2 * grid.rows)
    chosen = np.zeros((len(w), 2 * grid.rows**2), np.float32)
    chosen[np.arange(len(w)), row * 2 * grid.rows + column] = 1.0
    return chosen


MATERIALS = (
    Material("matte", None),
    Material("rough gloss", 0.5),
    Material("gloss", 0.3),
    Material("mirror-like", 0.15),
    Material("mirror, on screen", 0.0, on_screen=True),
)


class RelitObjects:
    """A dome of surface points of every material: what each reflects under a map of radiance.

    Args:
        grid: of the maps.
        points: surface points of each material, facing or mirroring evenly spread directions of the upper hemisphere.
    """

    def __init__(self, grid: MapGrid, points: int = 200) -> None:
        self.grid = grid
        toward = hemisphere_points(points)
        self._kernels = {material.roughness: material.kernel(toward, grid) for material in MATERIALS}

    def appearance(self, radiance: ArrayLike) -> list[Array]:
        """What the points of each material reflect, (points, 3) each, under radiance (rows, columns, 3)."""
        flat = np.asarray(radiance, np.float32).reshape(-1, 3)
        reflected = [(self._kernels[material.roughness] @ flat).astype(float) for material in MATERIALS]
        return [
            np.clip(light, 0.0, 1.0) if material.on_screen else light
            for material, light in zip(MATERIALS, reflected, strict=True)
        ]

    def errors(self, estimated: ArrayLike, true: ArrayLike) -> Array:
        """(materials,) rms over points and channels of the difference, relative to the rms of the true appearance."""
        pairs = zip(self.appearance(estimated), self.appearance(true), strict=True)
        return np.array([np.sqrt(np.mean((found - right) ** 2) / np.mean(right**2)) for found, right in pairs])
