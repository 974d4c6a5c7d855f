"""An object of our own: a varnished knot standing on a round pedestal beside a ball, made by formula.

It shows what lighting does: one part's shadow on another, gloss in every direction, and contact with the sheet.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.rendering.mesh import Mesh, joined, smooth_normals

Array = NDArray[np.float64]

_STONE = (0.60, 0.58, 0.54)
_TERRACOTTA = (0.55, 0.13, 0.05)
_IVORY = (0.74, 0.64, 0.48)
_TEAL = (0.02, 0.24, 0.27)


def default_object() -> Mesh:
    """The knot, its pedestal and the ball, in units of its own, z up; about 5000 vertices; always the same."""
    ball = _lathed(_ball_profile(radius=0.85), 40, _TEAL)
    return joined(
        [
            _lathed(_pedestal_profile(radius=2.0, height=0.7, edge=0.15), 60, _STONE),
            _trefoil(along=144, around=16, tube=0.46, lift=2.88),
            Mesh(ball.vertices_mm + [2.2, -2.5, 0.0], ball.normals, ball.faces, ball.base_colour, closed=True),
        ]
    )


def _pedestal_profile(radius: float, height: float, edge: float) -> Array:
    """(r, z) of a disk with rounded edges, from the middle below to the middle above."""
    turn = np.linspace(0.0, np.pi / 2, 5)
    low = np.stack([radius - edge + edge * np.sin(turn), edge - edge * np.cos(turn)], axis=-1)
    high = np.stack([radius - edge + edge * np.cos(turn), height - edge + edge * np.sin(turn)], axis=-1)
    top = np.linspace(radius - 2 * edge, 0.0, 14)
    return np.concatenate([[[0.0, 0.0]], low, high, np.stack([top, np.full_like(top, height)], axis=-1)])


def _ball_profile(radius: float) -> Array:
    turn = np.linspace(-np.pi / 2, np.pi / 2, 21)
    return np.stack([radius * np.cos(turn), radius * (1.0 + np.sin(turn))], axis=-1)


def _lathed(profile: Array, around: int, colour: tuple[float, float, float]) -> Mesh:
    """The surface that a profile (p, 2) of (radius, height) sweeps about the z axis."""
    azimuth = np.arange(around) * 2.0 * np.pi / around
    radius, height = profile[:, :1], profile[:, 1:]
    grid = np.stack(
        [radius * np.cos(azimuth), radius * np.sin(azimuth), np.broadcast_to(height, (len(profile), around))], axis=-1
    )
    return _closed_grid(grid, np.broadcast_to(np.array(colour), grid.shape), wraps_first=False)


def _trefoil(along: int, around: int, tube: float, lift: float) -> Mesh:
    """A trefoil knot's tube, standing on two of its lobes, its colour running from terracotta to ivory."""
    t = np.arange(along) * 2.0 * np.pi / along
    curve = np.stack([-np.sin(t) - 2.0 * np.sin(2 * t), np.sin(3 * t) * 0.9, 2.0 * np.cos(2 * t) - np.cos(t)], axis=-1)
    curve *= 0.86
    tangent = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.cross(tangent, [0.0, 1.0, 0.0])
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
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = faces[area > 1e-9].astype(np.int32)
    corners = vertices[faces]
    # the sign of the enclosed volume tells whether the grid runs inside out
    if np.sum(np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]) < 0:
        faces = faces[:, ::-1].copy()
    normals = smooth_normals(vertices, faces)
    return Mesh(vertices, normals, faces, colour.reshape(-1, 3).astype(np.float32), closed=True)
