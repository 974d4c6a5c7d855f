"""Where the camera sees an object: pixels, the region they fill, clip coordinates; lens distortion included."""

import ctypes
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.camera import Camera, Pose
from arlight.native import address, library
from arlight.tracking.lens import camera_parameters
from arlight.video.frame import Region

Array = NDArray[np.float32]

_NEAR_SHARE = 0.02
"""Near plane, as a share of the camera's distance from the sheet's origin."""
_LENS_REACH = 1.3
"""Undistorted image radii, relative to the frame's corner, beyond which a lens model is not trusted."""
_project = library(__file__, "projection", keeps_lock=True).project_points
_project.restype = ctypes.c_int64
_project.argtypes = [ctypes.c_void_p, ctypes.c_int64, *[ctypes.c_void_p] * 4]


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
    seen: int
    """How many of the points are beyond the near plane."""
    box_px: tuple[float, float, float, float]
    """(x0, y0, x1, y1) of the points [px]; means nothing unless all of them are seen."""

    def region(self, margin_px: int = 2) -> Region | None:
        """The part of the frame that holds the points and what lies between them; None if there is none.

        If some of the points are behind the near plane the region is the whole frame.
        """
        if self.seen == 0:
            return None
        width, height = self.frame_size
        if self.seen < len(self.depth_mm):
            return Region(0, 0, width, height)
        x0, y0, x1, y1 = (min(max(v, -1e6), 1e6) for v in self.box_px)
        region = Region(
            math.floor(x0) - margin_px, math.floor(y0) - margin_px,
            math.ceil(x1) + 1 + margin_px, math.ceil(y1) + 1 + margin_px,
        ).clipped(self.frame_size)  # fmt: skip
        return region if min(region.size) > 0 else None

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


class Projector:
    """A camera's projection, ready for many poses."""

    def __init__(self, camera: Camera) -> None:
        """Take down the camera's parameters."""
        self._size = camera.image_size
        # as `View` of projection.c: pose, lens, near plane, how far the lens is followed
        self._view = np.zeros(39)
        self._view[12:37] = camera_parameters(camera)
        self._view[38] = _LENS_REACH * _corner_radius(camera) if np.any(camera.distortion) else 0.0
        self._view_address = address(self._view, np.float64)
        self._box = np.empty(4, np.float32)
        self._box_address = address(self._box, np.float32)

    def project(self, camera_from_probe: Pose, points_mm: ArrayLike) -> Projected:
        """Points (n, 3) of the probe frame [mm] in a pose; without the lens where its model may fold back."""
        points = np.ascontiguousarray(points_mm, np.float32).reshape(-1, 3)
        translation = camera_from_probe.translation
        near = _NEAR_SHARE * float(np.sqrt(translation @ translation))
        self._view[:9] = camera_from_probe.rotation.reshape(-1)
        self._view[9:12] = translation
        self._view[37] = near
        pixels, depth = np.empty((len(points), 2), np.float32), np.empty(len(points), np.float32)
        found = (address(array, np.float32) for array in (points, pixels, depth))
        seen = _project(self._view_address, len(points), *found, self._box_address)
        x0, y0, x1, y1 = self._box.tolist()
        return Projected(pixels, depth, near, self._size, seen, (x0, y0, x1, y1))


def project(camera: Camera, camera_from_probe: Pose, points_mm: ArrayLike) -> Projected:
    """Points (n, 3) of the probe frame [mm] as the camera sees them; `Projector` is for many poses."""
    return Projector(camera).project(camera_from_probe, points_mm)


def _corner_radius(camera: Camera) -> float:
    width, height = camera.image_size
    corners = [[0.0, 0.0], [width - 1.0, 0.0], [0.0, height - 1.0], [width - 1.0, height - 1.0]]
    return float(np.linalg.norm(camera.rays(corners), axis=1).max())
