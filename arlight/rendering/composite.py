"""Differential rendering in linear light: the plane darkens by a ratio, the object covers, nothing else changes."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.rendering.shadow import PlaneGrid
from arlight.video.frame import Region

Image = NDArray[np.float32]


def shade_plane(
    linear: Image, region: Region, camera: Camera, camera_from_probe: Pose, grid: PlaneGrid, ratio: Image
) -> None:
    """Multiply a region of the frame, in place, by the shadow's ratio at the point of the plane that each pixel sees.

    Args:
        linear: (h, w, 3) linear light of `region`, changed in place.
        region: pixels of the frame.
        camera: intrinsics; lens distortion is followed exactly.
        camera_from_probe: the pose.
        grid: where the ratio's texels lie on the plane z = 0.
        ratio: (side, side, 3) irradiance with the object over irradiance without.
    """
    homography = np.column_stack(
        [camera_from_probe.rotation[:, 0], camera_from_probe.rotation[:, 1], camera_from_probe.translation]
    )
    texel_from_plane = np.array(
        [
            [1.0 / grid.texel_mm, 0.0, -grid.corner_mm[0] / grid.texel_mm - 0.5],
            [0.0, 1.0 / grid.texel_mm, -grid.corner_mm[1] / grid.texel_mm - 0.5],
            [0.0, 0.0, 1.0],
        ]
    )
    texel_from_ray = texel_from_plane @ np.linalg.inv(homography)
    rays = camera.ray_map[region.y0 : region.y1, region.x0 : region.x1]
    _multiply(linear, rays, texel_from_ray.astype(np.float32), np.ascontiguousarray(ratio, np.float32))


def cover(linear: Image, x: int, y: int, drawn: Image) -> None:
    """Lay premultiplied radiance and coverage (h, w, 4) over linear light, in place, its top left pixel at (x, y)."""
    _cover(linear[y : y + drawn.shape[0], x : x + drawn.shape[1]], drawn)


@njit(cache=True, nogil=True)
def _cover(linear, drawn):  # type: ignore[no-untyped-def]
    for y in range(linear.shape[0]):
        for x in range(linear.shape[1]):
            if drawn[y, x, 3] > 0.0:
                left = np.float32(1.0) - drawn[y, x, 3]
                for c in range(3):
                    linear[y, x, c] = linear[y, x, c] * left + drawn[y, x, c]


@njit(cache=True, nogil=True, fastmath=True)
def _multiply(linear, rays, texel_from_ray, ratio):  # type: ignore[no-untyped-def]
    """Bilinear ratio at each pixel's point of the plane; outside of the map, and above the horizon, 1."""
    side = ratio.shape[0]
    m = texel_from_ray
    for y in range(linear.shape[0]):
        for x in range(linear.shape[1]):
            rx, ry = rays[y, x, 0], rays[y, x, 1]
            inverse_depth = m[2, 0] * rx + m[2, 1] * ry + m[2, 2]
            if inverse_depth <= 0.0:
                continue
            u = (m[0, 0] * rx + m[0, 1] * ry + m[0, 2]) / inverse_depth
            v = (m[1, 0] * rx + m[1, 1] * ry + m[1, 2]) / inverse_depth
            if not (0.0 <= u < side - 1 and 0.0 <= v < side - 1):
                continue
            column, row = int(u), int(v)
            fu, fv = u - np.float32(column), v - np.float32(row)
            for c in range(3):
                upper = ratio[row, column, c] * (np.float32(1.0) - fu) + ratio[row, column + 1, c] * fu
                lower = ratio[row + 1, column, c] * (np.float32(1.0) - fu) + ratio[row + 1, column + 1, c] * fu
                linear[y, x, c] *= upper * (np.float32(1.0) - fv) + lower * fv
