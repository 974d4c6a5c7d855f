"""The shadow on the sheet: what the object takes from the irradiance of the plane z = 0, linear in the light."""

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.native import address, library
from arlight.rendering.mesh import Mesh
from arlight.rendering.reconstruction import Reconstruction

Array = NDArray[np.float64]
Rows = NDArray[np.float32]

_darken = library(__file__, "shadow", keeps_lock=True).darken
_darken.restype = None
_darken.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
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
        hidden = np.zeros((len(self.hidden_rows), 4), np.float32)
        hidden[:, :3] = self.hidden_rows @ light
        return Darkening(self.grid).ratio(hidden, self.open_row @ light)[..., :3]

    def openness_along(self, points_mm: Array, direction: Array) -> Rows:
        """Openness (p,) of the ground where rays from points (p, 3) along a downward direction (3,) meet it."""
        reach = np.maximum(points_mm[:, 2], 0.0) / -direction[2]
        column, row = np.rint(self.grid.texel_of(points_mm[:, :2] + reach[:, None] * direction[:2])).astype(int).T
        last = self.grid.side - 1
        inside = (column >= 0) & (row >= 0) & (column <= last) & (row <= last)
        return np.where(inside, self.openness[np.clip(row, 0, last), np.clip(column, 0, last)], np.float32(1.0))


class Darkening:
    """What an object leaves of the plane's light, from one light to the next. Not for two threads at once."""

    def __init__(self, grid: PlaneGrid, faint: float = 0.0) -> None:
        """Set out the texels.

        Args:
            grid: the texels.
            faint: what is darkened by less than this share is left alone. From twice the share down to it darkening
                fades to nothing, so that no contour shows where it ends.
        """
        self._grid, self._faint = grid, faint
        self._ratio = np.ones((grid.side, grid.side, 4), np.float32)
        self._ratio_address = address(self._ratio, np.float32)
        self._box = (ctypes.c_int64 * 4)()
        # the outline of a square of side 1, in steps, because a lens bends it
        steps = np.linspace(0.0, 1.0, 9)
        low, high = np.zeros(9), np.ones(9)
        outline = [np.concatenate(parts) for parts in ((steps, steps, low, high), (low, high, steps, steps))]
        self._square = np.stack([*outline, np.zeros(36)], axis=-1)

    def ratio(self, hidden: Rows, open_plane: Rows) -> Rows:
        """The share of the open plane's irradiance that is left.

        Args:
            hidden: (side * side, 4) irradiance that each texel loses, three colours and 0.
            open_plane: (3,) irradiance of the open plane.

        Returns:
            (side, side, 4): three colours in [0, 1], and the least of them; 1 where the open plane itself is dark.
            Overwritten by the next call.
        """
        if hidden.shape != (self._grid.side**2, 4):
            raise ValueError(f"expected what {self._grid.side**2} texels lose in four numbers, found {hidden.shape}")
        open_three = np.ascontiguousarray(open_plane, np.float32)
        _darken(
            address(hidden, np.float32), address(open_three, np.float32), self._grid.side, self._faint or 1e-30,
            self._ratio_address, self._box,
        )  # fmt: skip
        return self._ratio

    def outline_mm(self) -> Rows | None:
        """Outline (36, 3) of what the texels that are darkened at all reach in bilinear lookup; None without any."""
        first_column, last_column, first_row, last_row = self._box
        if last_row < first_row:
            return None
        grid, step = self._grid, self._grid.texel_mm
        corner = (grid.corner_mm[0] + (first_column - 0.5) * step, grid.corner_mm[1] + (first_row - 0.5) * step, 0.0)
        size = ((last_column - first_column + 2.0) * step, (last_row - first_row + 2.0) * step, 0.0)
        return np.asarray(self._square * size + corner, np.float32)


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
    irradiance = (directions[:, 2] * (2.0 * np.pi / len(directions))).astype(np.float32)
    hidden = np.float32(1.0) - seen.astype(np.float32) * np.float32(1.0 / 255.0)
    openness = 1.0 - irradiance @ hidden / np.pi
    rows = hidden.T @ (irradiance[:, None] * reconstruction.radiance_rows(directions).astype(np.float32))
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
