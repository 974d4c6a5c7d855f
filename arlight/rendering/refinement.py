"""Draws a mesh finer than it is lit: every triangle becomes four, on the curved surface that its normals tell of.

Light varies slowly over a surface and costs in proportion to the vertices it is folded into; outline and gloss do not.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.rendering.mesh import Mesh

Array = NDArray[np.float64]
Numbers = NDArray[np.int32]

_SMOOTH_COSINE = 0.3
"""Where the normals of an edge's ends differ by more, nothing is known of the surface between them."""


@dataclass(frozen=True, slots=True)
class Refinement:
    """A finer mesh, and where its vertices come from."""

    mesh: Mesh
    """The coarse mesh's vertices first, then those halfway along its edges."""
    ends: Numbers
    """(k, 2) for each of the latter, the numbers of the edge's two ends."""

    def carried(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """What the coarse mesh's vertices carry, (n, ...), at the finer one's, (n + k, ...): means along the edges."""
        return np.concatenate([values, (values[self.ends[:, 0]] + values[self.ends[:, 1]]) * np.float32(0.5)])


def refined(mesh: Mesh) -> Refinement:
    """Every triangle in four.

    Source: A. Vlachos et al., Curved PN Triangles (2001): the cubic and the quadratic of an edge, in its middle.
    """
    sides = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    keys, number = np.unique(sides[:, 0] * len(mesh.vertices_mm) + sides[:, 1], return_inverse=True)
    ends = np.stack(np.divmod(keys, len(mesh.vertices_mm)), axis=-1).astype(np.int32)
    middles = _middles(mesh, ends)
    a, b, c = mesh.faces.T
    ab, bc, ca = (len(mesh.vertices_mm) + number.reshape(-1, 3)).T
    faces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=-1).reshape(-1, 3).astype(np.int32)
    same = Refinement(mesh, ends)
    finer = replace(
        mesh,
        vertices_mm=np.concatenate([mesh.vertices_mm, middles]),
        normals=np.concatenate([mesh.normals, _middle_normals(mesh, ends)]),
        faces=faces,
        base_colour=same.carried(mesh.base_colour),
        uv=None if mesh.uv is None else same.carried(mesh.uv),
        layer=None if mesh.layer is None else same.carried(mesh.layer),
    )
    return Refinement(finer, ends)


def _middles(mesh: Mesh, ends: Numbers) -> Array:
    """Middles (k, 3) of edges on the curved surface; one point for all edges between the same two places."""
    (start, end), (first, second) = (mesh.vertices_mm[ends[:, i]] for i in (0, 1)), _end_normals(mesh, ends)
    along = end - start
    bulge = np.sum(along * second, axis=1, keepdims=True) * second
    bulge -= np.sum(along * first, axis=1, keepdims=True) * first
    bulge[np.sum(first * second, axis=1) < _SMOOTH_COSINE] = 0.0
    # vertices are split at creases and seams, where both sides must move together or a crack opens
    _, place = np.unique(mesh.vertices_mm, axis=0, return_inverse=True)
    between = np.sort(place.reshape(-1)[ends].astype(np.int64), axis=1)
    _, group = np.unique(between[:, 0] * len(place) + between[:, 1], return_inverse=True)
    total = np.stack([np.bincount(group, column) for column in bulge.T], axis=-1) / np.bincount(group)[:, None]
    return np.asarray((start + end) / 2.0 + total[group] / 8.0, float)


def _middle_normals(mesh: Mesh, ends: Numbers) -> Array:
    first, second = _end_normals(mesh, ends)
    along = mesh.vertices_mm[ends[:, 1]] - mesh.vertices_mm[ends[:, 0]]
    total, length_squared = first + second, np.sum(along**2, axis=1, keepdims=True)
    turned = total - 2.0 * along * np.sum(along * total, axis=1, keepdims=True) / np.maximum(length_squared, 1e-300)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.where(length > 1e-6, turned / np.maximum(length, 1e-6), first)


def _end_normals(mesh: Mesh, ends: Numbers) -> tuple[Array, Array]:
    return mesh.normals[ends[:, 0]], mesh.normals[ends[:, 1]]
