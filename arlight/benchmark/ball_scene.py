"""Balls beside the sheet, traced ray by ray into a rendered picture: what a camera sees of a mirrored or a matte one.

Every sample of a pixel meets the sphere by itself and carries back what the environment, or the table below the
horizon, sends there. A ball rests on the table, hides part of the sky from it and mirrors what it darkened; its shadow
on the sheet and the sheet's mirror image in it are left out, so that every probe meets the same light.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.camera import Camera, Pose
from arlight.environment import Environment

Array = NDArray[np.float64]
Finish = Literal["mirror", "matte"]

_NORMAL_ROWS = 32
_EDGE_PX = 3


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball in the scene."""

    center_mm: tuple[float, float, float]
    """Its centre, probe frame [mm]."""
    radius_mm: float
    """Its radius [mm]."""
    finish: Finish
    """`mirror` reflects one direction, `matte` is Lambertian."""
    reflectance: float
    """Of the mirror, or of the matte surface, in (0, 1]."""

    def openness(self, points_mm: Array) -> Array:
        """Share (n, 1) of an even sky's light that the ball leaves to points (n, 3) of the table that it rests on.

        Source: form factor of a sphere above the horizon, (r/d)^2 cos(theta).
        """
        toward = np.asarray(self.center_mm) - points_mm
        distance = np.linalg.norm(toward, axis=1, keepdims=True)
        return 1.0 - (self.radius_mm / distance) ** 2 * toward[:, 2:] / distance


@dataclass(frozen=True)
class SurroundingLight:
    """Light from all directions: the environment above the horizon, an evenly lit table below."""

    environment: Environment
    """What shines from above."""
    table_albedo: tuple[float, float, float]
    """Of the table, linear RGB."""

    @cached_property
    def ground_radiance(self) -> Array:
        """(3,) radiance of the table."""
        return np.asarray(self.table_albedo) * self.environment.irradiance() / np.pi

    def radiance(self, directions: ArrayLike) -> Array:
        """Radiance (..., 3) from unit directions (..., 3), probe frame; nothing stands on the table."""
        w = np.asarray(directions, float)
        return np.where(w[..., 2:] >= 0.0, self.environment.radiance_at(w), self.ground_radiance)

    def irradiance(self, normals: ArrayLike) -> Array:
        """Irradiance (n, 3) of unoccluded surfaces with unit normals (n, 3)."""
        n = np.asarray(normals, float)
        directions, light = self.environment.samples()
        cosine = np.maximum(n.astype(np.float32) @ directions.T.astype(np.float32), 0.0)
        ground = np.pi * (1.0 - n[:, 2:]) / 2.0
        return (cosine @ light.astype(np.float32)).astype(float) + ground * self.ground_radiance

    @cached_property
    def irradiance_map(self) -> Environment:
        """Irradiance of every normal, to be looked up like radiance; it is smooth."""
        theta = (np.arange(_NORMAL_ROWS) + 0.5)[:, None] * np.pi / _NORMAL_ROWS
        phi = (np.arange(2 * _NORMAL_ROWS) + 0.5)[None, :] * np.pi / _NORMAL_ROWS
        up = np.broadcast_to(np.cos(theta), (_NORMAL_ROWS, 2 * _NORMAL_ROWS))
        normals = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), up], axis=-1)
        values = self.irradiance(normals.reshape(-1, 3)).reshape(*normals.shape)
        return Environment(values.astype(np.float32))


def with_ball(
    picture: NDArray[np.float32],
    camera: Camera,
    pose: Pose,
    ball: Ball,
    light: SurroundingLight,
    sheet_mm: tuple[float, float],
    per_side: int = 5,
) -> NDArray[np.float32]:
    """The picture with a ball in it.

    Args:
        picture: (h, w, 3) linear radiance of the sheet on its table.
        camera: that sees it.
        pose: camera_from_probe [mm].
        ball: what is put in; it rests on the table, and does not hide the sheet.
        light: that falls on it.
        sheet_mm: width and height of the sheet [mm].
        per_side: samples along a pixel's side.
    """
    x0, y0, x1, y1 = _bounds(camera, pose, ball)
    offsets = (np.arange(per_side) + 0.5) / per_side - 0.5
    xs = (np.arange(x0, x1)[:, None] + offsets).ravel()
    ys = (np.arange(y0, y1)[:, None] + offsets).ravel()
    rays = camera.rays(np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2))
    directions = np.column_stack([rays, np.ones(len(rays))]) @ pose.rotation
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen, hit = _shade(pose.camera_centre_mm, directions, ball, light)
    shape = (y1 - y0, per_side, x1 - x0, per_side)
    covered = hit.reshape(shape).mean(axis=(1, 3))[..., None]
    shade = seen.reshape(*shape, 3).mean(axis=(1, 3))
    result = picture * _table_openness(camera, pose, ball, sheet_mm)
    result[y0:y1, x0:x1] = result[y0:y1, x0:x1] * (1.0 - covered) + shade
    return result


def _shade(
    origin: Array, directions: Array, ball: Ball, light: SurroundingLight
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Radiance (n, 3) along rays, 0 where they miss the ball, and whether they meet it (n,)."""
    to_center = np.asarray(ball.center_mm) - origin
    along = directions @ to_center
    inside = along**2 - (to_center @ to_center - ball.radius_mm**2)
    hit = inside > 0.0
    distance = along[hit] - np.sqrt(inside[hit])
    ray = directions[hit]
    normals = (origin + distance[:, None] * ray - ball.center_mm) / ball.radius_mm
    radiance = np.zeros((len(directions), 3), np.float32)
    if ball.finish == "mirror":
        reflected = ray - 2.0 * np.sum(ray * normals, axis=1)[:, None] * normals
        radiance[hit] = ball.reflectance * _mirrored(normals, reflected, ball, light)
    else:
        radiance[hit] = ball.reflectance / np.pi * light.irradiance_map.radiance_at(normals)
    return radiance, hit


def _mirrored(normals: Array, reflected: Array, ball: Ball, light: SurroundingLight) -> Array:
    """Radiance (n, 3) from reflected directions (n, 3), the table darkened where the ball stands."""
    radiance = light.radiance(reflected)
    down = reflected[:, 2] < -1e-6
    start = np.asarray(ball.center_mm) + ball.radius_mm * normals[down]
    table_z = ball.center_mm[2] - ball.radius_mm
    meets = start + ((table_z - start[:, 2]) / reflected[down, 2])[:, None] * reflected[down]
    radiance[down] *= ball.openness(meets)
    return radiance


def _table_openness(camera: Camera, pose: Pose, ball: Ball, sheet_mm: tuple[float, float]) -> NDArray[np.float32]:
    """(h, w, 1) what the ball leaves of the light at each pixel's point of the table; 1 on the sheet."""
    rays = camera.ray_map.reshape(-1, 2).astype(float)
    directions = np.column_stack([rays, np.ones(len(rays))]) @ pose.rotation
    origin = pose.camera_centre_mm
    down = directions[:, 2] < 0.0
    table_z = ball.center_mm[2] - ball.radius_mm
    points = origin + ((table_z - origin[2]) / directions[down, 2])[:, None] * directions[down]
    openness = np.ones((len(rays), 1), np.float32)
    on_sheet = np.all(np.abs(points[:, :2]) < np.asarray(sheet_mm) / 2.0 + 2.0, axis=1, keepdims=True)
    openness[down] = np.where(on_sheet, 1.0, ball.openness(points))
    return openness.reshape(*camera.image_size[::-1], 1)


def _bounds(camera: Camera, pose: Pose, ball: Ball) -> tuple[int, int, int, int]:
    """Pixels x0 <= x < x1, y0 <= y < y1 around the ball, inside the picture."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * ball.radius_mm
    pixels = camera.project(pose, corners + ball.center_mm)
    low = np.floor(pixels.min(axis=0)).astype(int) - _EDGE_PX
    high = np.ceil(pixels.max(axis=0)).astype(int) + _EDGE_PX
    width, height = camera.image_size
    return max(low[0], 0), max(low[1], 0), min(high[0], width), min(high[1], height)
