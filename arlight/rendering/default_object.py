"""An object of our own: a glossy knot wound over a disk, with a ball in it, made by formula.

It shows what lighting does: a broad matte pedestal, one part's shadow on another, and a curved gloss in every direction.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.rendering.mesh import Mesh, joined, smooth_normals

Array = NDArray[np.float64]

_IVORY = (0.72, 0.66, 0.56)
_TERRACOTTA = (0.62, 0.17, 0.07)
_TEAL = (0.03, 0.30, 0.33)


def default_object() -> Mesh:
    """The knot, its pedestal and the ball, in units of its own, z up; about 6500 vertices; always the same."""
    return joined(
        [
            _lathed(_pedestal_profile(), 72, _IVORY, 0.0),
            _trefoil(along=216, around=20, tube=0.40, lift=1.62),
            _lathed(_ball_profile(radius=0.62), 48, _TEAL, 0.45),
        ]
    )


def _pedestal_profile() -> Array:
    """(r, z) of a low disk with rounded edges, from the middle below to the middle above."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 9)
    edge = np.stack([3.0 + 0.2 * np.cos(turn), 0.22 + 0.2 * np.sin(turn)], axis=-1)
    top = np.stack([np.linspace(2.9, 0.0, 26), np.full(26, 0.42)], axis=-1)
    return np.concatenate([[[0.0, 0.02], [1.5, 0.02]], edge, top])


def _ball_profile(radius: float) -> Array:
    turn = np.linspace(-np.pi / 2, np.pi / 2, 25)
    return np.stack([radius * np.cos(turn), radius * (1.0 + np.sin(turn))], axis=-1)


def _lathed(profile: Array, around: int, colour: tuple[float, float, float], lift: float) -> Mesh:
    """The surface that a profile (p, 2) of (radius, height) sweeps about the z axis."""
    azimuth = np.arange(around) * 2.0 * np.pi / around
    radius, height = profile[:, :1], profile[:, 1:] + lift
    grid = np.stack(
        [radius * np.cos(azimuth), radius * np.sin(azimuth), np.broadcast_to(height, (len(profile), around))], axis=-1
    )
    return _closed_grid(grid, np.broadcast_to(np.array(colour), grid.shape), wraps_first=False)


def _trefoil(along: int, around: int, tube: float, lift: float) -> Mesh:
    """A trefoil knot's tube, its colour running from terracotta to ivory with its height."""
    t = np.arange(along) * 2.0 * np.pi / along
    curve = np.stack([np.sin(t) + 2.0 * np.sin(2 * t), np.cos(t) - 2.0 * np.cos(2 * t), -np.sin(3 * t)], axis=-1)
    curve *= [0.78, 0.78, 0.75]
    tangent = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.cross(tangent, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    upward = np.cross(across, tangent)
    s = np.arange(around) * 2.0 * np.pi / around
    ring = across[:, None] * np.cos(s)[:, None] + upward[:, None] * np.sin(s)[:, None]
    grid = curve[:, None] + tube * ring + [0.0, 0.0, lift]
    share = 0.5 + 0.5 * np.sin(3 * t)[:, None, None]
    colour = np.broadcast_to(share * np.array(_TERRACOTTA) + (1.0 - share) * np.array(_IVORY), grid.shape)
    return _closed_grid(grid, colour, wraps_first=True)


def _closed_grid(grid: Array, colour: Array, wraps_first: bool) -> Mesh:
    """Triangles over a grid (a, b, 3) of points that closes on itself along b, and along a if `wraps_first`."""
    a, b = grid.shape[:2]
    row = np.arange(a if wraps_first else a - 1)[:, None]
    column = np.arange(b)[None, :]
    first, second = row * b + column, row * b + (column + 1) % b
    third, fourth = (row + 1) % a * b + (column + 1) % b, (row + 1) % a * b + column
    faces = np.concatenate([np.stack([first, second, third], -1), np.stack([first, third, fourth], -1)]).reshape(-1, 3)
    vertices = grid.reshape(-1, 3)
    area = np.linalg.norm(
        np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]), axis=1
    )
    faces = faces[area > 1e-9].astype(np.int32)
    normals = smooth_normals(vertices, faces)
    if _signed_volume(vertices, faces) < 0:
        faces, normals = faces[:, ::-1], -normals
    return Mesh(vertices, normals, faces, colour.reshape(-1, 3).astype(np.float32))


def _signed_volume(vertices: Array, faces: NDArray[np.int32]) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.sum(np.cross(a, b) * c) / 6.0)
