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
    shadow = plane_shadow(grid, seen[:, len(lifted) :], upper, reconstruction)
    above = _hidden(seen[:, : len(lifted)])
    below = _hidden(visibility(mesh, lifted, lower))
    for hidden, direction in zip(below, lower, strict=True):
        hidden[:] = 1.0 - (1.0 - hidden) * shadow.openness_along(lifted, direction)
    return Transfer(
        _vertex_rows(mesh.normals, above, upper, below, lower, reconstruction),
        _openness(mesh.normals, np.concatenate([above, below]), upper, lower),
        shadow,
    )


def _hidden(seen: NDArray[np.uint8]) -> Rows:
    return np.float32(1.0) - seen.astype(np.float32) * np.float32(1.0 / 255.0)


def _vertex_rows(
    normals: Array, above: Rows, upper: Array, below: Rows, lower: Array, reconstruction: Reconstruction
) -> Rows:
    """Rows (n, m) from what is hidden, (d, n), along directions (d, 3) above and below the horizon."""
    lost = [
        _facing(normals, w) * hidden * np.float32(2.0 * np.pi / len(w))
        for w, hidden in ((upper, above), (lower, below))
    ]
    irradiance = reconstruction.irradiance_rows(normals)
    irradiance -= lost[0].T @ reconstruction.radiance_rows(upper).astype(np.float32)
    irradiance -= lost[1].sum(axis=0)[:, None] * reconstruction.ground_radiance_row
    return (irradiance / np.pi).astype(np.float32)


def _facing(normals: Array, directions: Array) -> Rows:
    """(d, n) cosine between normals and directions, 0 behind the surface."""
    cosine: Rows = directions.astype(np.float32) @ normals.T.astype(np.float32)
    return np.maximum(cosine, np.float32(0.0), out=cosine)


def _openness(normals: Array, hidden: Rows, upper: Array, lower: Array) -> Rows:
    """Least-squares harmonics of the visibility over the directions in front of each vertex, drawn toward 1."""
    directions = np.concatenate([upper, lower])
    solid_angle = np.repeat([2.0 * np.pi / len(upper), 2.0 * np.pi / len(lower)], [len(upper), len(lower)])
    basis = harmonics(directions)
    first, second = np.triu_indices(9)
    front = (_facing(normals, directions) > 0.0).astype(np.float32)
    # the Gram matrix is symmetric: its upper triangle alone is integrated
    products = (basis[:, first] * basis[:, second] * solid_angle[:, None]).astype(np.float32)
    gram = np.empty((len(normals), 9, 9), np.float32)
    gram[:, first, second] = gram[:, second, first] = front.T @ products
    gram += np.float32(_RIDGE_SR / (4.0 * np.pi)) * np.eye(9, dtype=np.float32)
    missing = (front * hidden).T @ (basis * solid_angle[:, None]).astype(np.float32)
    coefficients: Rows = -np.linalg.solve(gram, missing[..., None])[..., 0]
    coefficients[:, 0] += np.float32(1.0 / basis[0, 0])
    return coefficients


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
