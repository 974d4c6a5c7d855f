"""The shadow on the sheet: what the object takes from the irradiance of the plane z = 0, linear in the light."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.rendering.mesh import Mesh
from arlight.rendering.reconstruction import Reconstruction

Array = NDArray[np.float64]
Rows = NDArray[np.float32]

_REACH_HEIGHTS = 1.0
"""How far the map reaches beyond the object, in heights of the object: light above 45 degrees stays inside."""
_FADE = 0.35
"""Share of the map's half side over which a shadow longer than the map is faded out; there it takes a few per cent."""


@dataclass(frozen=True, slots=True)
class PlaneGrid:
    """A square of texels on the plane z = 0, rows along +y, columns along +x."""

    corner_mm: tuple[float, float]
    """(x, y) of the corner of texel (0, 0) [mm]."""
    texel_mm: float
    """Side of a texel [mm]."""
    side: int
    """Texels along a side."""

    def texel_centres_mm(self) -> Array:
        """(side * side, 3) centres on the plane, row by row."""
        steps = (np.arange(self.side) + 0.5) * self.texel_mm
        x, y = np.meshgrid(self.corner_mm[0] + steps, self.corner_mm[1] + steps)
        return np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)

    def texel_of(self, points_mm: ArrayLike) -> Array:
        """(..., 2) fractional (column, row) of points (..., >= 2) of the plane; texel centres lie at integers."""
        return (np.asarray(points_mm, float)[..., :2] - self.corner_mm) / self.texel_mm - 0.5


@dataclass(frozen=True, slots=True)
class PlaneShadow:
    """The part of the plane's irradiance that the object leaves, as a linear map of the coefficients."""

    grid: PlaneGrid
    """Where the texels lie."""
    hidden_rows: Rows
    """(side * side, m) irradiance that the object hides from each texel, faded to 0 at the map's edge."""
    open_row: Rows
    """(m,) irradiance on the open plane."""
    openness: Rows
    """(side, side) share of irradiance left under uniform light."""

    @staticmethod
    def grid_around(mesh: Mesh, side: int) -> PlaneGrid:
        """A map centred under the object that reaches as far as its shadow matters."""
        low, high = mesh.vertices_mm.min(axis=0), mesh.vertices_mm.max(axis=0)
        half = float(max(high[:2] - low[:2]) / 2.0 + _REACH_HEIGHTS * max(high[2], 0.0))
        half = max(half, 1e-3 * mesh.bounding_sphere_mm[1])
        middle = (low + high) / 2.0
        return PlaneGrid((float(middle[0] - half), float(middle[1] - half)), 2.0 * half / side, side)

    def ratio(self, packed: ArrayLike) -> Rows:
        """Irradiance with the object over irradiance without, per texel and channel.

        Args:
            packed: (m, 3) real-packed coefficients.

        Returns:
            (side, side, 3) in [0, 1]; 1 where the open plane itself would be dark.
        """
        light = np.asarray(packed, np.float32)
        open_plane = self.open_row @ light
        usable = open_plane > 0.0
        hidden = (self.hidden_rows @ light) / np.where(usable, open_plane, 1.0)
        # the reconstructed radiance may dip below 0 somewhere, which would brighten the plane
        ratio: Rows = np.clip(np.float32(1.0) - np.where(usable, hidden, np.float32(0.0)), 0.0, 1.0)
        return ratio.reshape(self.grid.side, self.grid.side, -1)

    def openness_along(self, points_mm: Array, direction: Array) -> Rows:
        """Openness (p,) of the ground where rays from points (p, 3) along a downward direction (3,) meet it."""
        reach = np.maximum(points_mm[:, 2], 0.0) / -direction[2]
        column, row = np.rint(self.grid.texel_of(points_mm[:, :2] + reach[:, None] * direction[:2])).astype(int).T
        last = self.grid.side - 1
        inside = (column >= 0) & (row >= 0) & (column <= last) & (row <= last)
        return np.where(inside, self.openness[np.clip(row, 0, last), np.clip(column, 0, last)], np.float32(1.0))


def plane_shadow(
    grid: PlaneGrid, seen: NDArray[np.uint8], directions: Array, reconstruction: Reconstruction
) -> PlaneShadow:
    """Weigh what each texel does not see by the light that would have come from there.

    Args:
        grid: the texels.
        seen: (d, side * side) visibility of each direction, 0 to 255.
        directions: (d, 3) equal-area directions of the upper hemisphere.
        reconstruction: the matrix from coefficients to radiance.
    """
    irradiance = directions[:, 2] * (2.0 * np.pi / len(directions))
    hidden = (1.0 - seen.T.astype(np.float32) / 255.0) * irradiance.astype(np.float32)
    openness = 1.0 - hidden.sum(axis=1) / np.pi
    rows = hidden @ reconstruction.radiance_rows(directions).astype(np.float32)
    return PlaneShadow(
        grid,
        (rows * _fade(grid.side).reshape(-1, 1)).astype(np.float32),
        reconstruction.upward_irradiance_row.astype(np.float32),
        np.clip(openness, 0.0, 1.0).reshape(grid.side, grid.side).astype(np.float32),
    )


def _fade(side: int) -> Array:
    """(side, side) 1 inside, falling smoothly to 0 at the outermost texels."""
    inward = np.minimum(np.arange(side), np.arange(side)[::-1]) / (side / 2.0)
    ramp = np.clip(inward / _FADE, 0.0, 1.0)
    ramp = ramp**2 * (3.0 - 2.0 * ramp)
    return ramp[:, None] * ramp[None, :]
