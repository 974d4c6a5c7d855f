"""Differential rendering in linear light: the plane darkens by a ratio, the object covers, nothing else changes."""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.native import Workspace, address, library
from arlight.rendering.shadow import PlaneGrid
from arlight.video.frame import Region

Image = NDArray[np.float32]

_CELL_PX = 8
"""Between two nodes of the net of rays, as in composite.c: a lens bends what lies between by less than 0.02 px."""
_native = library(__file__, "composite")
_native.shade_plane.restype = _native.cover.restype = None
_native.shade_plane.argtypes = [ctypes.c_void_p]
_native.cover.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64]


class _Plane(Workspace):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("linear", "rays", "ratio")),
        *((name, ctypes.c_int64) for name in ("x0", "y0", "width", "height", "node_columns", "side")),
        ("texel_from_ray", ctypes.c_double * 9),
    )


class PlaneShader:
    """Darkens the plane in a camera's frames."""

    def __init__(self, camera: Camera, grid: PlaneGrid) -> None:
        """Follow the camera's rays, lens distortion included.

        Args:
            camera: intrinsics.
            grid: where the ratio's texels lie on the plane z = 0.
        """
        # one node beyond the last pixel on each side, so that every cell has two
        x, y = (np.arange(size // _CELL_PX + 2) * float(_CELL_PX) for size in camera.image_size)
        nodes = np.stack(np.meshgrid(x, y), axis=-1)
        rays = camera.rays(nodes.reshape(-1, 2)).astype(np.float32)
        self._plane = _Plane(node_columns=len(x), side=grid.side)
        self._plane.hold({"rays": rays})
        self._texel_from_plane = np.array(
            [
                [1.0 / grid.texel_mm, 0.0, -grid.corner_mm[0] / grid.texel_mm - 0.5],
                [0.0, 1.0 / grid.texel_mm, -grid.corner_mm[1] / grid.texel_mm - 0.5],
                [0.0, 0.0, 1.0],
            ]
        )

    def shade(self, linear: Image, region: Region, camera_from_probe: Pose, ratio: Image) -> None:
        """Multiply a region of the frame, in place, by the ratio at the point of the plane that each pixel sees.

        Args:
            linear: (h, w, 3) linear light of `region`, changed in place.
            region: pixels of the frame.
            camera_from_probe: the pose.
            ratio: (side, side, 4) irradiance with the object over irradiance without, and an unused column.
        """
        rotation, plane = camera_from_probe.rotation, self._plane
        if linear.shape != (region.size[1], region.size[0], 3) or ratio.shape != (plane.side, plane.side, 4):
            raise ValueError(
                f"linear {linear.shape} or ratio {ratio.shape} do not fit {region} and {plane.side} texels"
            )
        homography = np.column_stack([rotation[:, 0], rotation[:, 1], camera_from_probe.translation])
        try:
            texel_from_ray = self._texel_from_plane @ np.linalg.inv(homography)
        except np.linalg.LinAlgError:
            return  # seen edge-on the plane has no pixels
        plane.texel_from_ray[:] = texel_from_ray.reshape(-1).tolist()
        plane.x0, plane.y0 = region.x0, region.y0
        plane.width, plane.height = region.size
        plane.linear, plane.ratio = address(linear, np.float32), address(ratio, np.float32)
        _native.shade_plane(ctypes.byref(plane))


def cover(linear: Image, x: int, y: int, drawn: Image) -> None:
    """Lay premultiplied radiance and coverage (h, w, 4) over linear light, in place, its top left pixel at (x, y)."""
    (height, width), (rows, columns) = drawn.shape[:2], linear.shape[:2]
    if x < 0 or y < 0 or x + width > columns or y + height > rows:
        raise ValueError(f"a picture of {width}x{height} at ({x}, {y}) leaves the region of {columns}x{rows} pixels")
    start = address(linear, np.float32) + 12 * (y * columns + x)
    _native.cover(start, columns, address(drawn, np.float32), width, height)
