"""Differential rendering in linear light: the plane darkens by a ratio, nothing else changes."""

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
_NODE_PX = 4
"""Between two pixels at which the ratio is looked up, as in composite.c."""
_native = library(__file__, "composite")
_native.plane_gain.restype = None
_native.plane_gain.argtypes = [ctypes.c_void_p]


class _Plane(Workspace):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("gain", "rays", "ratio", "lines")),
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
        # nodes beyond the last pixel on each side, so that every cell has two
        x, y = (np.arange(size // _CELL_PX + 2) * float(_CELL_PX) for size in camera.image_size)
        nodes = np.stack(np.meshgrid(x, y), axis=-1)
        rays = camera.rays(nodes.reshape(-1, 2)).astype(np.float32)
        self._plane = _Plane(node_columns=len(x), side=grid.side)
        lines = np.empty((3, camera.image_size[0] // _NODE_PX + 2, 4), np.float32)
        self._plane.hold({"rays": rays, "lines": lines})
        self._buffer = np.empty(0, np.float32)
        self._texel_from_plane = np.array(
            [
                [1.0 / grid.texel_mm, 0.0, -grid.corner_mm[0] / grid.texel_mm - 0.5],
                [0.0, 1.0 / grid.texel_mm, -grid.corner_mm[1] / grid.texel_mm - 0.5],
                [0.0, 0.0, 1.0],
            ]
        )

    def gain(self, region: Region, camera_from_probe: Pose, ratio: Image) -> Image:
        """What the light of every pixel is multiplied by: the ratio at the point of the plane that it sees.

        Args:
            region: pixels of the frame.
            camera_from_probe: the pose.
            ratio: (side, side, 4) irradiance with the object over irradiance without, and an unused column.

        Returns:
            (h, w, 3) of the region, 1 where no point of the map is seen; overwritten by the next call.
        """
        rotation, plane = camera_from_probe.rotation, self._plane
        if ratio.shape != (plane.side, plane.side, 4):
            raise ValueError(f"expected a ratio of {plane.side} texels a side, found {ratio.shape}")
        gain = self._room(*region.size)
        homography = np.column_stack([rotation[:, 0], rotation[:, 1], camera_from_probe.translation])
        try:
            texel_from_ray = self._texel_from_plane @ np.linalg.inv(homography)
        except np.linalg.LinAlgError:
            gain.fill(1.0)  # seen edge-on the plane has no pixels
            return gain
        plane.texel_from_ray[:] = texel_from_ray.reshape(-1).tolist()
        plane.x0, plane.y0 = region.x0, region.y0
        plane.width, plane.height = region.size
        plane.gain, plane.ratio = address(gain, np.float32), address(ratio, np.float32)
        _native.plane_gain(ctypes.byref(plane))
        return gain

    def _room(self, width: int, height: int) -> Image:
        """Memory that was touched before: to get it afresh for every frame takes longer than to fill it."""
        if self._buffer.size <= 3 * width * height:
            self._buffer = np.empty(3 * width * height + 1, np.float32)
        return self._buffer[: 3 * width * height].reshape(height, width, 3)
