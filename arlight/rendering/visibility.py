"""What an object hides from the light: depth maps along many directions, looked up at points on and around it.

One parallel depth map per direction costs milliseconds for thousands of triangles, whatever the number of points; a
ray caster without native code would cost as much per few hundred points.
"""

from collections.abc import Callable, Iterator

import moderngl
import numpy as np
from numba import njit
from numpy.typing import NDArray

from arlight.gl import create_context, shader_source
from arlight.rendering.mesh import Mesh

Array = NDArray[np.float64]
Progress = Callable[[float], None]

_MAP_SIZE = 256
_BIAS_TEXELS = 1.5
"""How far a point must lie behind the map's surface to be hidden; less than this is the map's own rounding."""


def visibility(mesh: Mesh, points_mm: Array, directions: Array, progress: Progress | None = None) -> NDArray[np.uint8]:
    """How much of each direction every point sees past the mesh.

    The points of a surface should be lifted off it along their normals by `surface_offset_mm`.

    Args:
        mesh: the object in the probe frame [mm].
        points_mm: (p, 3) points, on the mesh or beside it, probe frame [mm].
        directions: (d, 3) unit vectors toward the light; any hemisphere.
        progress: called with the share done, from 0 to 1.

    Returns:
        (d, p) visibility, 0 hidden to 255 free; between them where the outline passes through a map's texel.
    """
    centre, radius = mesh.bounding_sphere_mm
    points = np.ascontiguousarray(points_mm - centre, np.float32)
    seen = np.empty((len(directions), len(points)), np.uint8)
    context = create_context()
    try:
        with context:
            maps = _depth_maps(context, mesh.vertices_mm - centre, mesh.faces, [_basis(d) / radius for d in directions])
            for i, (basis, nearest) in enumerate(maps):
                _look_up(nearest, basis.astype(np.float32), points, seen[i])
                if progress is not None:
                    progress((i + 1) / len(directions))
    finally:
        context.release()
    return seen


def _depth_maps(
    context: moderngl.Context, vertices: Array, faces: NDArray[np.int32], bases: list[Array]
) -> Iterator[tuple[Array, NDArray[np.float32]]]:
    """For each basis, across and along the light in units of the radius, the depth nearest to the light per texel."""
    program = context.program(vertex_shader=shader_source("depth.vert"), fragment_shader=shader_source("depth.frag"))
    depth = context.depth_texture((_MAP_SIZE, _MAP_SIZE))
    target = context.framebuffer(depth_attachment=depth)
    positions = context.buffer(np.ascontiguousarray(vertices, np.float32))
    indices = context.buffer(np.ascontiguousarray(faces, np.int32))
    triangles = context.vertex_array(program, [(positions, "3f", "position")], indices)
    context.enable_only(context.DEPTH_TEST)
    target.use()
    for basis in bases:
        clip = np.eye(4)
        clip[:3, :3] = basis * [[1.0], [1.0], [-1.0]]
        program["clip_from_probe"] = tuple(clip.T.reshape(-1).tolist())
        target.clear(depth=1.0)
        triangles.render()
        yield basis, np.frombuffer(depth.read(), np.float32).reshape(_MAP_SIZE, _MAP_SIZE)


def surface_offset_mm(mesh: Mesh) -> float:
    """How far to lift points off the mesh so that its depth maps do not hide them from themselves [mm]."""
    return _BIAS_TEXELS * 2.0 * mesh.bounding_sphere_mm[1] / _MAP_SIZE


def _basis(direction: Array) -> Array:
    """Rows: two axes across the direction and the direction itself."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < 0.7 else np.array([0.0, 1.0, 0.0])
    first = np.cross(helper, direction)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first), direction])


@njit(cache=True, nogil=True, fastmath=True)
def _look_up(nearest, basis, points, seen):  # type: ignore[no-untyped-def]
    """Compare each point's depth with the four texels around it, weighted bilinearly."""
    size = nearest.shape[0]
    half_bias = np.float32(_BIAS_TEXELS) / np.float32(size)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        u = (basis[0, 0] * x + basis[0, 1] * y + basis[0, 2] * z + 1.0) * 0.5 * size - 0.5
        v = (basis[1, 0] * x + basis[1, 1] * y + basis[1, 2] * z + 1.0) * 0.5 * size - 0.5
        seen[i] = 255
        if not (0.0 <= u < size - 1 and 0.0 <= v < size - 1):
            continue
        # the map's depth grows away from the light over [0, 1]; 1 is empty, also to points that lie beyond
        depth = min(0.5 - 0.5 * (basis[2, 0] * x + basis[2, 1] * y + basis[2, 2] * z) - half_bias, 1.0)
        column, row = int(u), int(v)
        fu, fv = u - column, v - row
        free = (1.0 - fv) * ((1.0 - fu) * (nearest[row, column] >= depth) + fu * (nearest[row, column + 1] >= depth))
        free += fv * ((1.0 - fu) * (nearest[row + 1, column] >= depth) + fu * (nearest[row + 1, column + 1] >= depth))
        seen[i] = np.uint8(255.0 * free + 0.5)
