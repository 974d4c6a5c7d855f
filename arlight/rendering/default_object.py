"""An object of our own: a varnished knot standing on a round pedestal beside a ball, made by formula.

It shows what lighting does: one part's shadow on another, gloss in every direction, and contact with the sheet.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from arlight.rendering.mesh import Mesh, joined

Array = NDArray[np.float64]

_STONE = (0.60, 0.58, 0.54)
_TERRACOTTA = (0.55, 0.13, 0.05)
_IVORY = (0.74, 0.64, 0.48)
_TEAL = (0.02, 0.24, 0.27)


_TUBE = 0.46
_PEDESTAL_RADIUS = 2.0
_BALL_RADIUS = 0.85
_BALL_PLACE = np.array([2.2, -2.5, 0.0])
_FACES = 4000
"""Triangles without a budget; drawn refined, more do not improve the picture of an object 200 pixels across."""
_LEAST_FACES = 400


def default_object(faces: int | None = None) -> Mesh:
    """The knot, its pedestal and the ball, in units of its own, z up; always the same.

    Args:
        faces: triangles at most, not counting what 400 cannot show; 4000 by default.
    """
    # with these numbers of steps there are 9 200 triangles, and they grow with the square
    fine = math.sqrt(max(faces or _FACES, _LEAST_FACES) / 9200.0)
    ball = _lathed(*_ball_profile(_BALL_RADIUS, _steps(20, fine)), _steps(40, fine), _TEAL)
    ball = Mesh(ball.vertices_mm + _BALL_PLACE, ball.normals, ball.faces, ball.base_colour, closed=True)
    pedestal = _lathed(*_pedestal_profile(_PEDESTAL_RADIUS, 0.7, 0.15, fine), _steps(60, fine), _STONE)
    knot = _trefoil(_steps(96, fine), _steps(24, fine))
    return replace(joined([pedestal, knot, ball]), box_mm=_box())


def _box() -> Array:
    """(2, 3) corners of the bounding box of the smooth surfaces, so that the size does not depend on the triangles."""
    curve, tangent = _trefoil_curve(2000)
    reach = _TUBE * np.sqrt(1.0 - tangent**2)
    pedestal = np.array([_PEDESTAL_RADIUS, _PEDESTAL_RADIUS, 0.0])
    low = np.stack([(curve - reach).min(axis=0), -pedestal, _BALL_PLACE - [_BALL_RADIUS, _BALL_RADIUS, 0.0]])
    high = np.stack([(curve + reach).max(axis=0), pedestal, _BALL_PLACE + _BALL_RADIUS])
    return np.stack([low.min(axis=0), high.max(axis=0)])


def _steps(count: int, fine: float) -> int:
    return max(int(count * fine), 3)


def _pedestal_profile(radius: float, height: float, edge: float, fine: float) -> tuple[Array, Array]:
    """(r, z) of a disk with rounded edges, from the middle below to the middle above, and the normals there."""
    turn = np.linspace(0.0, np.pi / 2, _steps(4, fine) + 1)
    low = np.stack([radius - edge + edge * np.sin(turn), edge - edge * np.cos(turn)], axis=-1)
    high = np.stack([radius - edge + edge * np.cos(turn), height - edge + edge * np.sin(turn)], axis=-1)
    top = np.linspace(radius - 2 * edge, 0.0, _steps(14, fine))
    flat = np.stack([top, np.full_like(top, height)], axis=-1)
    outward = np.stack([np.sin(turn), -np.cos(turn)], axis=-1)
    return (
        np.concatenate([[[0.0, 0.0]], low, high, flat]),
        np.concatenate([[[0.0, -1.0]], outward, np.stack([np.cos(turn), np.sin(turn)], -1), 0.0 * flat + [0.0, 1.0]]),
    )


def _ball_profile(radius: float, steps: int) -> tuple[Array, Array]:
    turn = np.linspace(-np.pi / 2, np.pi / 2, steps + 1)
    outward = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return radius * (outward + [0.0, 1.0]), outward


def _lathed(profile: Array, outward: Array, around: int, colour: tuple[float, float, float]) -> Mesh:
    """The surface that a profile (p, 2) of (radius, height), with its normals (p, 2), sweeps about the z axis."""
    azimuth = np.arange(around) * 2.0 * np.pi / around
    turned = np.stack([np.cos(azimuth), np.sin(azimuth), np.ones(around)], axis=-1)
    grid, normals = (values[:, None, [0, 0, 1]] * turned for values in (profile, outward))
    return _closed_grid(grid, normals, np.broadcast_to(np.array(colour), grid.shape), wraps_first=False)


def _trefoil_curve(along: int) -> tuple[Array, Array]:
    """Points (along, 3) of a trefoil knot that stands on two of its lobes, and unit tangents there."""
    t = np.arange(along) * 2.0 * np.pi / along
    curve = np.stack([-np.sin(t) - 2.0 * np.sin(2 * t), np.sin(3 * t) * 0.9, 2.0 * np.cos(2 * t) - np.cos(t)], axis=-1)
    tangent = np.stack([-np.cos(t) - 4.0 * np.cos(2 * t), np.cos(3 * t) * 2.7, np.sin(t) - 4.0 * np.sin(2 * t)], -1)
    return 0.86 * curve + [0.0, 0.0, 2.88], tangent / np.linalg.norm(tangent, axis=1, keepdims=True)


def _trefoil(along: int, around: int) -> Mesh:
    """The knot's tube, its colour running from terracotta to ivory."""
    curve, tangent = _trefoil_curve(along)
    across = np.cross(tangent, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    upward = np.cross(across, tangent)
    s = np.arange(around) * 2.0 * np.pi / around
    ring = across[:, None] * np.cos(s)[:, None] + upward[:, None] * np.sin(s)[:, None]
    grid = curve[:, None] + _TUBE * ring
    share = 0.5 + 0.5 * np.sin(3.0 * np.arange(along) * 2.0 * np.pi / along)[:, None, None]
    colour = np.broadcast_to(share * np.array(_TERRACOTTA) + (1.0 - share) * np.array(_IVORY), grid.shape)
    return _closed_grid(grid, ring, colour, wraps_first=True)


def _closed_grid(grid: Array, normals: Array, colour: Array, wraps_first: bool) -> Mesh:
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
    return Mesh(vertices, normals.reshape(-1, 3), faces, colour.reshape(-1, 3).astype(np.float32), closed=True)
