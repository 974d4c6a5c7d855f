"""Differential rendering in linear light: the plane darkens by a ratio, nothing else changes."""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.native import Workspace, address, library
from arlight.rendering.shadow import PlaneGrid
from arlight.video.dimming import NODE_PX, nodes_of
from arlight.video.frame import Region

Image = NDArray[np.float32]

_native = library(__file__, "composite")
_native.plane_left.restype = None
_native.plane_left.argtypes = [ctypes.c_void_p]


class _Plane(Workspace):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("left", "rays", "ratio", "texels")),
        *((name, ctypes.c_int64) for name in ("first_row", "first_column", "rows", "columns")),
        *((name, ctypes.c_int64) for name in ("all_rows", "all_columns", "side")),
        ("texel_from_plane", ctypes.c_double * 6),
        ("ray_from_plane", ctypes.c_double * 9),
    )


class PlaneShader:
    """Darkens the plane in a camera's frames."""

    def __init__(self, camera: Camera, grid: PlaneGrid) -> None:
        """Follow the camera's rays, lens distortion included.

        Args:
            camera: intrinsics.
            grid: where the ratio's texels lie on the plane z = 0.
        """
        rows, columns = nodes_of((0, 0, *camera.image_size))
        x, y = (np.arange(count) * float(NODE_PX) for count in (columns, rows))
        nodes = np.stack(np.meshgrid(x, y), axis=-1)
        rays = np.ascontiguousarray(camera.rays(nodes.reshape(-1, 2)).T, np.float32)
        self._plane = _Plane(all_rows=rows, all_columns=columns, side=grid.side)
        self._plane.hold({"rays": rays, "texels": np.empty((2, columns), np.float32)})
        scale, (left_mm, lower_mm) = 1.0 / grid.texel_mm, grid.corner_mm
        self._plane.texel_from_plane[:] = (scale, 0.0, -left_mm * scale - 0.5, 0.0, scale, -lower_mm * scale - 0.5)

    def left(self, region: Region, camera_from_probe: Pose, ratio: Image) -> Image:
        """What the object leaves of every pixel's light: the ratio at the point of the plane that it sees.

        Args:
            region: pixels of the frame, as a `Shade` covers them.
            camera_from_probe: the pose.
            ratio: (side, side, 4) irradiance with the object over irradiance without, and an unused column.

        Returns:
            (3, rows, columns) at every 4th pixel, as a `Shade` has it; 1 where no point of the map is seen.
        """
        rotation, plane = camera_from_probe.rotation, self._plane
        if ratio.shape != (plane.side, plane.side, 4):
            raise ValueError(f"expected a ratio of {plane.side} texels a side, found {ratio.shape}")
        rows, columns = nodes_of(region)
        left = np.empty((3, rows, columns), np.float32)
        r, t = rotation.ravel().tolist(), camera_from_probe.translation.tolist()
        plane.ray_from_plane[:] = (r[0], r[1], t[0], r[3], r[4], t[1], r[6], r[7], t[2])
        plane.first_row, plane.first_column = region.y0 // NODE_PX, region.x0 // NODE_PX
        plane.rows, plane.columns = rows, columns
        plane.left, plane.ratio = address(left, np.float32), address(ratio, np.float32)
        _native.plane_left(ctypes.byref(plane))
        return left
