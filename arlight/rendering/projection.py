"""Where the camera sees an object: pixels, the region they fill, clip coordinates; lens distortion included."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.camera import Camera, Pose
from arlight.video.frame import Region

Array = NDArray[np.float64]

_NEAR_SHARE = 0.02
"""Near plane, as a share of the camera's distance from the sheet's origin."""
_LENS_REACH = 1.3
"""Undistorted image radii, relative to the frame's corner, beyond which a lens model is not trusted."""


@dataclass(frozen=True, slots=True)
class Projected:
    """Points as the camera sees them."""

    pixels: Array
    """(n, 2) places in the frame [px]; meaningless for points behind the near plane."""
    depth_mm: Array
    """(n,) distance along the optical axis [mm]."""
    near_mm: float
    """Distance nearer than which nothing is drawn [mm]."""
    frame_size: tuple[int, int]
    """(width, height) of the frame [px]."""

    def region(self, margin_px: int = 2) -> Region | None:
        """The part of the frame that holds the points and what lies between them; None if there is none.

        If some of the points are behind the near plane the region is the whole frame.
        """
        in_front = self.depth_mm > self.near_mm
        if not in_front.any():
            return None
        if not in_front.all():
            return Region(0, 0, *self.frame_size)
        low = np.clip(np.floor(self.pixels.min(axis=0)) - margin_px, 0, self.frame_size).astype(int)
        high = np.clip(np.ceil(self.pixels.max(axis=0)) + 1 + margin_px, 0, self.frame_size).astype(int)
        if np.any(high <= low):
            return None
        return Region(int(low[0]), int(low[1]), int(high[0]), int(high[1]))

    def clip_coordinates(self, region: Region) -> NDArray[np.float32]:
        """(n, 4) clip coordinates whose viewport is a region of the frame, the viewport's row 0 its top row.

        Points land exactly where the camera sees them; w is the depth, so what lies between follows perspective.
        """
        width, height = region.size
        clip = np.empty((len(self.pixels), 4), np.float32)
        clip[:, 0] = ((self.pixels[:, 0] + 0.5 - region.x0) * (2.0 / width) - 1.0) * self.depth_mm
        clip[:, 1] = ((self.pixels[:, 1] + 0.5 - region.y0) * (2.0 / height) - 1.0) * self.depth_mm
        # z/w rises from -1 at the near plane toward 1 at infinity
        clip[:, 2] = self.depth_mm - 2.0 * self.near_mm
        clip[:, 3] = self.depth_mm
        return clip


@dataclass(frozen=True, slots=True)
class View:
    """An object as the camera sees it in one frame."""

    camera_from_probe: Pose
    """The pose."""
    projected: Projected
    """The object's vertices."""
    region: Region
    """The part of the frame to draw [px]."""


def project(camera: Camera, camera_from_probe: Pose, points_mm: ArrayLike) -> Projected:
    """Points (n, 3) of the probe frame [mm] as the camera sees them; without the lens where its model may fold back."""
    points = camera_from_probe.transform(points_mm)
    near = _NEAR_SHARE * float(np.linalg.norm(camera_from_probe.translation))
    depth = points[:, 2]
    normalised = points[:, :2] / np.where(np.abs(depth) < near, near, depth)[:, None]
    k = camera.camera_matrix
    pixels = normalised @ k[:2, :2].T + k[:2, 2]
    if np.any(camera.distortion):
        radius = np.linalg.norm(normalised, axis=1)
        trusted = (radius < _LENS_REACH * _corner_radius(camera)) & (depth > near)
        if trusted.any():
            at_origin = Pose(np.eye(3), np.zeros(3))
            pixels[trusted] = camera.project(at_origin, points[trusted])
    return Projected(pixels, depth, near, camera.image_size)


def union(first: Region | None, second: Region | None) -> Region | None:
    """The smallest region that holds both."""
    if first is None or second is None:
        return first or second
    return Region(
        min(first.x0, second.x0), min(first.y0, second.y0), max(first.x1, second.x1), max(first.y1, second.y1)
    )


def _corner_radius(camera: Camera) -> float:
    width, height = camera.image_size
    corners = [[0.0, 0.0], [width - 1.0, 0.0], [0.0, height - 1.0], [width - 1.0, height - 1.0]]
    return float(np.linalg.norm(camera.rays(corners), axis=1).max())
