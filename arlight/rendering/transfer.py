"""Precomputed linear transfer: from the coefficients to each vertex's diffuse light and to how freely it sees around.

Everything is (integral kernel) @ R, computed once per object; a frame costs one small matrix product. The unoccluded
part is integrated finely and what the object hides from itself is subtracted, so that a point which nothing hides is
exact whatever the number of directions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.radiance_prior import hemisphere_points
from arlight.rendering.mesh import Mesh
from arlight.rendering.reconstruction import Reconstruction
from arlight.rendering.shadow import PlaneShadow, plane_shadow
from arlight.rendering.visibility import Progress, surface_offset_mm, visibility

Array = NDArray[np.float64]
Rows = NDArray[np.float32]

_RIDGE_SR = 0.3
"""Pull of the visibility's harmonics toward 1, in solid angle of imagined free directions [sr]."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """What the coefficients do to one object on the sheet; rows are meant as `rows @ packed`."""

    vertex_rows: Rows
    """(n, m) irradiance/pi at each vertex: the radiance of a white matte surface there, the mesh's shadow on itself and
    the light bounced off the ground included."""
    openness: Rows
    """(n, 9) second-order spherical harmonics of each vertex's visibility, for the gloss."""
    shadow: PlaneShadow
    """What the object takes from the plane z = 0."""


def precompute_transfer(
    mesh: Mesh,
    reconstruction: Reconstruction,
    directions: int = 768,
    shadow_texels: int = 128,
    progress: Progress | None = None,
) -> Transfer:
    """Cast the object's shadows along many directions, once.

    Args:
        mesh: placed on the sheet, probe frame [mm].
        reconstruction: the matrix from coefficients to radiance.
        directions: equal-area directions above the horizon; a quarter as many below.
        shadow_texels: side of the plane's shadow map.
        progress: called with the share done, from 0 to 1.

    Raises:
        RenderingUnavailableError: no headless OpenGL.
    """
    upper, lower = hemisphere_points(directions), hemisphere_points(max(directions // 4, 1)) * [1.0, 1.0, -1.0]
    lifted = mesh.vertices_mm + mesh.normals * surface_offset_mm(mesh)
    grid = PlaneShadow.grid_around(mesh, shadow_texels)
    seen = visibility(mesh, np.concatenate([lifted, grid.texel_centres_mm()]), upper, progress)
    seen_above, seen_plane = seen[:, : len(lifted)], seen[:, len(lifted) :]
    shadow = plane_shadow(grid, seen_plane, upper, reconstruction)
    seen_below = visibility(mesh, lifted, lower).astype(np.float32) / 255.0
    for i, direction in enumerate(lower):
        seen_below[i] *= shadow.openness_along(lifted, direction)
    above = seen_above.astype(np.float32) / 255.0
    return Transfer(
        _vertex_rows(mesh.normals, above, upper, seen_below, lower, reconstruction),
        _openness(mesh.normals, np.concatenate([above, seen_below]), np.concatenate([upper, lower])),
        shadow,
    )


def _vertex_rows(
    normals: Array, above: Rows, upper: Array, below: Rows, lower: Array, reconstruction: Reconstruction
) -> Rows:
    hidden_above = (1.0 - above).T * np.maximum(normals @ upper.T, 0.0) * (2.0 * np.pi / len(upper))
    hidden_below = (1.0 - below).T * np.maximum(normals @ lower.T, 0.0) * (2.0 * np.pi / len(lower))
    irradiance = reconstruction.irradiance_rows(normals) - hidden_above @ reconstruction.radiance_rows(upper)
    irradiance -= hidden_below.sum(axis=1, keepdims=True) * reconstruction.ground_radiance_row
    return (irradiance / np.pi).astype(np.float32)


def _openness(normals: Array, seen: Rows, directions: Array) -> Rows:
    """Least-squares harmonics of the visibility over the directions in front of each vertex, drawn toward 1."""
    basis = harmonics(directions)
    solid_angle = np.full(len(directions), 4.0 * np.pi / len(directions))
    upper = directions[:, 2] > 0
    solid_angle[upper] = 2.0 * np.pi / np.count_nonzero(upper)
    solid_angle[~upper] = 2.0 * np.pi / np.count_nonzero(~upper)
    weight = np.where(normals @ directions.T > 0.0, solid_angle, 0.0)
    products = (basis[:, :, None] * basis[:, None, :]).reshape(len(directions), 81)
    gram = (weight @ products).reshape(-1, 9, 9) + _RIDGE_SR * np.eye(9) / (4.0 * np.pi)
    missing = (weight * (seen.T - 1.0)) @ basis
    coefficients = np.linalg.solve(gram, missing[..., None])[..., 0]
    coefficients[:, 0] += 1.0 / basis[0, 0]
    return coefficients.astype(np.float32)


def harmonics(directions: Array) -> Array:
    """Real spherical harmonics to the second order (d, 9) of unit directions (d, 3); the order of the shader's."""
    x, y, z = directions.T
    return np.stack(
        [
            np.full_like(x, 0.282095),
            0.488603 * y,
            0.488603 * z,
            0.488603 * x,
            1.092548 * x * y,
            1.092548 * y * z,
            0.315392 * (3.0 * z**2 - 1.0),
            1.092548 * x * z,
            0.546274 * (x**2 - y**2),
        ],
        axis=-1,
    )
