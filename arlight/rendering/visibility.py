"""What an object hides from the light: depth maps along many directions, looked up at points on and around it.

One parallel depth map per direction costs a fraction of a millisecond for thousands of triangles, whatever the number
of points; casting a ray for every point and direction would cost a hundred times as much.
"""

import ctypes
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from arlight.native import Workspace, address, library
from arlight.rendering.mesh import Mesh

Array = NDArray[np.float64]
Progress = Callable[[float], None]

_MAP_SIDE = 256
_LANES = 4
"""Texels of a row that are drawn at once, as in visibility.c."""
_BIAS_TEXELS = 1.5
"""How far a point must lie behind the map's surface to be hidden; less than this is the map's own rounding."""
_DIRECTIONS_A_CALL = 64
"""Enough for a call to last much longer than it takes to begin one."""
_look_along = library(__file__, "visibility").look_along
_look_along.restype = None
_look_along.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p]


class _Scene(Workspace):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("vertices", "faces", "points", "placed", "nearest")),
        *((name, ctypes.c_int64) for name in ("vertex_count", "face_count", "closed", "point_count", "side")),
        ("bias", ctypes.c_double),
    )


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
    vertices, points = (
        np.ascontiguousarray(((np.asarray(places, float) - centre) / radius).T, np.float32)
        for places in (mesh.vertices_mm, points_mm)
    )
    bases = _bases(np.asarray(directions, float))
    seen = np.empty((len(bases), len(points_mm)), np.uint8)

    def look(first: int) -> int:
        some = slice(first, first + _DIRECTIONS_A_CALL)
        scene = _scene(mesh, vertices, points)
        _look_along(
            ctypes.byref(scene), address(bases[some], np.float32), len(bases[some]), address(seen[some], np.uint8)
        )
        return min(some.stop, len(bases))

    # the compiled code runs without the interpreter's lock
    with ThreadPoolExecutor(os.cpu_count(), "visibility") as threads:
        for done in threads.map(look, range(0, len(bases), _DIRECTIONS_A_CALL)):
            if progress is not None:
                progress(done / len(bases))
    return seen


def _scene(mesh: Mesh, vertices: NDArray[np.float32], points: NDArray[np.float32]) -> _Scene:
    """Vertices and points (3, n), which may be shared, with room to work in, which may not."""
    counts = {"vertex_count": len(mesh.vertices_mm), "face_count": len(mesh.faces), "point_count": points.shape[1]}
    scene = _Scene(**counts, closed=mesh.closed, side=_MAP_SIDE, bias=_BIAS_TEXELS / _MAP_SIDE)
    scene.hold(
        {
            "vertices": vertices,
            "faces": np.ascontiguousarray(mesh.faces, np.int32),
            "points": points,
            "placed": np.empty((len(mesh.vertices_mm), 4), np.float32),
            "nearest": np.empty(_MAP_SIDE**2 + _LANES, np.float32),
        }
    )
    return scene


def surface_offset_mm(mesh: Mesh) -> float:
    """How far to lift points off the mesh so that its depth maps do not hide them from themselves [mm]."""
    return _BIAS_TEXELS * 2.0 * mesh.bounding_sphere_mm[1] / _MAP_SIDE


def _bases(directions: Array) -> NDArray[np.float32]:
    """(d, 3, 3) rows: two axes across each direction and the direction itself."""
    helper = np.where(np.abs(directions[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(helper, directions)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(directions, first), directions], axis=1).astype(np.float32)
