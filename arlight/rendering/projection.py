"""Where the camera sees an object: clip coordinates per vertex, lens distortion included, for a region of the frame."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.camera import Camera, Pose
from arlight.video.frame import Region

Array = NDArray[np.float64]

NEAR_SHARE = 0.02
"""Near plane, as a share of the camera's distance from the sheet's origin."""
_LENS_REACH = 1.3
"""Undistorted image radii, relative to the frame's corner, beyond which a lens model is not trusted."""


def clip_coordinates(
    camera: Camera, camera_from_probe: Pose, points_mm: ArrayLike, region: Region
) -> NDArray[np.float32]:
    """Clip coordinates whose viewport is a region of the frame, row 0 of the viewport being the region's top row.

    Vertices land exactly where the camera sees them; w is the depth, so attributes between them follow perspective.

    Args:
        camera: intrinsics.
        camera_from_probe: the pose.
        points_mm: (n, 3) probe frame [mm].
        region: the frame's pixels that fill the viewport; may lie partly outside of the frame.

    Returns:
        (n, 4) float32.
    """
    points = camera_from_probe.transform(points_mm)
    depth = points[:, 2]
    near = NEAR_SHARE * float(np.linalg.norm(camera_from_probe.translation))
    pixels = _pixels(camera, points, np.where(np.abs(depth) < near, near, depth))
    width, height = region.x1 - region.x0, region.y1 - region.y0
    clip = np.empty((len(points), 4), np.float32)
    clip[:, 0] = ((pixels[:, 0] + 0.5 - region.x0) / width * 2.0 - 1.0) * depth
    clip[:, 1] = ((pixels[:, 1] + 0.5 - region.y0) / height * 2.0 - 1.0) * depth
    # z/w rises from -1 at the near plane toward 1 at infinity
    clip[:, 2] = depth - 2.0 * near
    clip[:, 3] = depth
    return clip


def covered_region(camera: Camera, camera_from_probe: Pose, points_mm: ArrayLike, margin_px: int = 2) -> Region | None:
    """The part of the frame that holds points (n, 3) and what lies between them; None if there is none.

    If some of the points are behind the camera the region is the whole frame.
    """
    points = camera_from_probe.transform(points_mm)
    near = NEAR_SHARE * float(np.linalg.norm(camera_from_probe.translation))
    width, height = camera.image_size
    in_front = points[:, 2] > near
    if not in_front.any():
        return None
    if not in_front.all():
        return Region(0, 0, width, height)
    pixels = _pixels(camera, points, points[:, 2])
    low = np.clip(np.floor(pixels.min(axis=0)) - margin_px, 0, [width, height]).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=0)) + 1 + margin_px, 0, [width, height]).astype(int)
    if np.any(high <= low):
        return None
    return Region(int(low[0]), int(low[1]), int(high[0]), int(high[1]))


def union(first: Region | None, second: Region | None) -> Region | None:
    """The smallest region that holds both."""
    if first is None or second is None:
        return first or second
    return Region(
        min(first.x0, second.x0), min(first.y0, second.y0), max(first.x1, second.x1), max(first.y1, second.y1)
    )


def _pixels(camera: Camera, points_camera_mm: Array, depth: Array) -> Array:
    """Pixels (n, 2) of points in the camera frame; without the lens where its model may fold back."""
    normalised = points_camera_mm[:, :2] / depth[:, None]
    k = camera.camera_matrix
    pixels = normalised @ k[:2, :2].T + k[:2, 2]
    if not np.any(camera.distortion):
        return pixels
    trusted = (np.linalg.norm(normalised, axis=1) < _LENS_REACH * _corner_radius(camera)) & (points_camera_mm[:, 2] > 0)
    if trusted.any():
        at_origin = Pose(np.eye(3), np.zeros(3))
        pixels[trusted] = camera.project(at_origin, np.c_[normalised[trusted], np.ones(np.count_nonzero(trusted))])
    return pixels


def _corner_radius(camera: Camera) -> float:
    width, height = camera.image_size
    corners = [[0.0, 0.0], [width - 1.0, 0.0], [0.0, height - 1.0], [width - 1.0, height - 1.0]]
    return float(np.linalg.norm(camera.rays(corners), axis=1).max())
