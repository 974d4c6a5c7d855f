"""The object to light: triangles with normals and base colour, standing on the sheet."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from arlight.errors import MeshError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mesh:
    """Triangles in the probe frame, z up; every vertex carries what the shader interpolates."""

    vertices_mm: Array
    """(n, 3) positions; millimetres once placed, the file's own unit before."""
    normals: Array
    """(n, 3) unit outward normals."""
    faces: NDArray[np.int32]
    """(m, 3) vertex numbers, counter-clockwise seen from outside."""
    base_colour: NDArray[np.float32]
    """(n, 3) linear reflectance, multiplied by the texture where there is one, in [0, 1]."""
    uv: NDArray[np.float32] | None = None
    """(n, 2) texture coordinates, v up; None without textures."""
    layer: NDArray[np.float32] | None = None
    """(n,) which of `textures` a vertex uses; None without textures."""
    textures: NDArray[np.uint8] | None = None
    """(layers, h, w, 3) sRGB images, row 0 at the top; None without textures."""
    closed: bool = False
    """Whether its faces enclose a volume, so that those turned away from the camera cannot be seen."""
    box_mm: Array | None = None
    """(2, 3) corners of the box of what the mesh stands for, where that is not the vertices' own."""

    def __post_init__(self) -> None:
        if len(self.faces) == 0 or len(self.vertices_mm) == 0:
            raise MeshError("the object has no faces; a triangle mesh is needed, not points or lines")
        if not np.all(np.isfinite(self.vertices_mm)):
            bad = int(np.count_nonzero(~np.isfinite(self.vertices_mm).all(axis=1)))
            raise MeshError(f"{bad} of the object's {len(self.vertices_mm)} vertices are not finite; repair the mesh")
        if not np.ptp(self.vertices_mm, axis=0).max() > 0.0:
            raise MeshError("the object has no extent: all its vertices coincide")

    @cached_property
    def bounding_sphere_mm(self) -> tuple[Array, float]:
        """Centre (3,) of the bounding box and the radius about it that holds every vertex, with 2 % to spare."""
        centre = (self.vertices_mm.min(axis=0) + self.vertices_mm.max(axis=0)) / 2.0
        return centre, 1.02 * float(np.linalg.norm(self.vertices_mm - centre, axis=1).max())

    @property
    def extent_mm(self) -> Array:
        """(3,) size of the bounding box along x, y and z."""
        return np.ptp(self.vertices_mm if self.box_mm is None else self.box_mm, axis=0)

    def placed(self, size_mm: float, position_mm: tuple[float, float] = (0.0, 0.0), yaw_deg: float = 0.0) -> "Mesh":
        """Scaled to `size_mm`, turned, and set on the sheet.

        Args:
            size_mm: the largest side of its bounding box before turning [mm].
            position_mm: (x, y) where the middle of its bounding box stands, probe frame [mm].
            yaw_deg: turn about +z, counter-clockwise from above [deg].

        Returns:
            The mesh in probe millimetres, its lowest point at z = 0.
        """
        if not (np.isfinite(size_mm) and size_mm > 0):
            raise MeshError(f"the object's size must be a positive length in millimetres, found {size_mm}")
        c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        scale = size_mm / self.extent_mm.max()
        vertices = (self.vertices_mm * scale) @ turn.T
        held = vertices if self.box_mm is None else (self._box_corners() * scale) @ turn.T
        low, high = held.min(axis=0), held.max(axis=0)
        origin = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
        vertices = vertices - origin + [*position_mm, 0.0]
        return replace(self, vertices_mm=vertices, normals=self.normals @ turn.T, box_mm=None)

    def standing_upright(self) -> "Mesh":
        """A mesh whose up axis is y (glTF, most OBJ files) turned so that z is up."""
        turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
        box = None if self.box_mm is None else self.box_mm @ turn.T
        return replace(self, vertices_mm=self.vertices_mm @ turn.T, normals=self.normals @ turn.T, box_mm=box)

    def _box_corners(self) -> Array:
        """(8, 3) corners of `box_mm`."""
        low, high = np.asarray(self.box_mm)
        return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def joined(parts: list[Mesh]) -> Mesh:
    """One mesh of several untextured ones."""
    offsets = np.cumsum([0] + [len(part.vertices_mm) for part in parts[:-1]])
    return Mesh(
        np.concatenate([part.vertices_mm for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)]).astype(np.int32),
        np.concatenate([part.base_colour for part in parts]),
        closed=all(part.closed for part in parts),
    )


def smooth_normals(vertices: Array, faces: NDArray[np.int32]) -> Array:
    """Unit vertex normals (n, 3), the area-weighted mean of the faces around each vertex; +z where they cancel."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    face_normals = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normals, faces[:, i], face_normals)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])
