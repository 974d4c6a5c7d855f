"""Brings triangles to what lighting per vertex needs: normals split at creases, faces neither coarse nor too many."""

from dataclasses import replace

import numpy as np
import trimesh
from numpy.typing import NDArray

from arlight.rendering.mesh import Mesh, smooth_normals

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

_CREASE_RAD = np.radians(40.0)
_COARSE_SHARE = 1.0 / 24.0
"""Edges longer than this share of the object's size are coarse."""


def creased_normals(vertices: Array, faces: Numbers) -> tuple[Array, Numbers, NDArray[np.int32], bool]:
    """Smooth normals, with vertices split where faces meet at more than 40 degrees.

    Args:
        vertices: (n, 3); several at one place, as at texture seams, count as one.
        faces: (m, 3) without degenerate ones.

    Returns:
        normals (k, 3), the vertex each of them came from (k,), faces (m, 3) into them, and whether they enclose a
        volume.
    """
    grain = 1e-6 * np.ptp(vertices, axis=0).max()
    _, place = np.unique(np.rint(vertices / grain).astype(np.int64), axis=0, return_inverse=True)
    welded = trimesh.Trimesh(np.zeros((place.max() + 1, 3)), place.reshape(-1)[faces], process=False)
    welded.vertices[place.reshape(-1)] = vertices
    smooth = welded.face_adjacency[welded.face_adjacency_angles < _CREASE_RAD]
    group = trimesh.graph.connected_component_labels(smooth, node_count=len(faces))
    # every face corner asks for one normal per place and group, and for one vertex per source vertex and group
    shading_faces = _numbered(welded.faces.reshape(-1), np.repeat(group, 3))[1].reshape(-1, 3)
    keys, corners = _numbered(faces.reshape(-1), np.repeat(group, 3))
    shading_vertices = np.zeros((shading_faces.max() + 1, 3))
    shading_vertices[shading_faces.reshape(-1)] = vertices[faces.reshape(-1)]
    shading_normals = smooth_normals(shading_vertices, shading_faces.astype(np.int32))
    normals = np.zeros((len(keys), 3))
    normals[corners] = shading_normals[shading_faces.reshape(-1)]
    closed = bool(welded.is_watertight and welded.is_winding_consistent and welded.volume > 0)
    return normals, keys[:, 0], corners.reshape(-1, 3).astype(np.int32), closed


def fit_to_budget(mesh: Mesh, max_vertices: int) -> Mesh:
    """Divide coarse faces, or merge vertices where there are more than the budget."""
    if len(mesh.vertices_mm) > max_vertices:
        return _clustered(mesh, max_vertices)
    size = mesh.extent_mm.max()
    while 4 * len(mesh.vertices_mm) <= max_vertices and np.quantile(_edge_lengths(mesh), 0.9) > _COARSE_SHARE * size:
        mesh = _subdivided(mesh)
    return mesh


def _subdivided(mesh: Mesh) -> Mesh:
    """Every face in four, attributes halfway."""
    layer = np.zeros(len(mesh.vertices_mm), np.float32) if mesh.layer is None else mesh.layer
    uv = np.zeros((len(mesh.vertices_mm), 2), np.float32) if mesh.uv is None else mesh.uv
    carried = np.concatenate([mesh.vertices_mm, mesh.normals, mesh.base_colour, uv, layer[:, None]], axis=1)
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, number = np.unique(edges, axis=0, return_inverse=True)
    middle = len(carried) + number.reshape(-1, 3)
    carried = np.concatenate([carried, carried[unique].mean(axis=1)])
    a, b, c = mesh.faces.T
    ab, bc, ca = middle.T
    faces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=-1).reshape(-1, 3).astype(np.int32)
    return _with_attributes(mesh, carried, faces)


def _clustered(mesh: Mesh, max_vertices: int) -> Mesh:
    """Merge the vertices of each cell of a grid, as fine as the budget allows, apart by texture place and crease."""
    layer = np.zeros(len(mesh.vertices_mm), np.float32) if mesh.layer is None else mesh.layer
    uv = np.zeros((len(mesh.vertices_mm), 2), np.float32) if mesh.uv is None else mesh.uv
    carried = np.concatenate([mesh.vertices_mm, mesh.normals, mesh.base_colour, uv, layer[:, None]], axis=1)
    kind = np.concatenate([np.rint(mesh.normals), np.floor(uv * 8.0), layer[:, None]], axis=1).astype(np.int64)
    finest, coarsest = 1e-5, 0.5
    for _ in range(16):
        share = np.sqrt(finest * coarsest)
        cell = np.floor((mesh.vertices_mm - mesh.vertices_mm.min(axis=0)) / (share * mesh.extent_mm.max())).astype(int)
        keys, cluster = np.unique(np.concatenate([cell, kind], axis=1), axis=0, return_inverse=True)
        finest, coarsest = (share, coarsest) if len(keys) > max_vertices else (finest, share)
    cell = np.floor((mesh.vertices_mm - mesh.vertices_mm.min(axis=0)) / (coarsest * mesh.extent_mm.max())).astype(int)
    _, cluster = np.unique(np.concatenate([cell, kind], axis=1), axis=0, return_inverse=True)
    merged = _means(carried, cluster.reshape(-1))
    # one position per cell, whatever the kinds in it, so that no crack opens
    _, place = np.unique(cell, axis=0, return_inverse=True)
    merged[cluster.reshape(-1), :3] = _means(mesh.vertices_mm, place.reshape(-1))[place.reshape(-1)]
    faces = cluster.reshape(-1)[mesh.faces]
    spots = place.reshape(-1)[mesh.faces]
    whole = (spots[:, 0] != spots[:, 1]) & (spots[:, 1] != spots[:, 2]) & (spots[:, 2] != spots[:, 0])
    return _with_attributes(mesh, merged, faces[whole].astype(np.int32))


def _with_attributes(mesh: Mesh, carried: Array, faces: NDArray[np.int32]) -> Mesh:
    length = np.linalg.norm(carried[:, 3:6], axis=1, keepdims=True)
    normals = np.where(length > 1e-9, carried[:, 3:6] / np.maximum(length, 1e-9), [0.0, 0.0, 1.0])
    return replace(
        mesh,
        vertices_mm=carried[:, :3],
        normals=normals,
        faces=faces,
        base_colour=carried[:, 6:9].astype(np.float32),
        uv=None if mesh.uv is None else carried[:, 9:11].astype(np.float32),
        layer=None if mesh.layer is None else carried[:, 11].astype(np.float32),
    )


def _means(values: Array, group: Numbers) -> Array:
    count = np.bincount(group)
    return np.stack([np.bincount(group, column) for column in values.T], axis=-1) / count[:, None]


def _numbered(first: Numbers, second: Numbers) -> tuple[Numbers, Numbers]:
    """Distinct pairs (k, 2), and the number of each given pair."""
    keys, number = np.unique(np.stack([first, second], axis=-1), axis=0, return_inverse=True)
    return keys, number.reshape(-1)


def _edge_lengths(mesh: Mesh) -> Array:
    corners = mesh.vertices_mm[mesh.faces]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).reshape(-1)
