"""Draws the lit object's own box of the frame with compiled code: no OpenGL, any thread, a frame in milliseconds."""

import ctypes

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.color import linear_from_encoded
from arlight.native import Workspace, address, library
from arlight.rendering.gloss import GLOSS_SIDE
from arlight.rendering.light_rows import LightRows
from arlight.rendering.mesh import Mesh
from arlight.rendering.projection import View
from arlight.rendering.refinement import Refinement
from arlight.rendering.transfer import Transfer

Image = NDArray[np.float32]

_CORNER = 8
"""Numbers of a corner, as in raster.c."""
_SIDE_BY_SIDE = 8
"""Samples that are drawn at once, as in samples.h."""
_BAND_SAMPLES = 1 << 15
"""A picture is drawn in bands of about so many samples: they stay in the processor's cache."""
_shade = library(__file__, "shading", keeps_lock=True).shade
_draw = library(__file__, "raster").draw
_shade.restype = _draw.restype = None
_shade.argtypes, _draw.argtypes = [ctypes.c_void_p], [ctypes.c_void_p] * 2


class _Shading(Workspace):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("position_mm", "normal", "base_colour", "openness", "lit", "gloss")),
        *((name, ctypes.c_void_p) for name in ("ends", "body", "mirrored", "scratch")),
        *((name, ctypes.c_int64) for name in ("count", "lit_count", "side")),
        ("eye_mm", ctypes.c_double * 3),
        *((name, ctypes.c_double) for name in ("roughness", "normal_reflectance")),
    )


class _Raster(Workspace):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("pixels", "depth_mm", "body", "mirrored", "faces", "texture_place")),
        *((name, ctypes.c_void_p) for name in ("corners", "listed", "sorted", "kept", "band_ends")),
        *((name, ctypes.c_int64) for name in ("room", "bands", "band_rows")),
        ("planes", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("plane", "width", "height", "top", "bottom")),
        *((name, ctypes.c_int64) for name in ("vertex_count", "face_count", "closed", "samples")),
        *((name, ctypes.c_void_p) for name in ("levels", "linear")),
        *((name, ctypes.c_int64) for name in ("layers", "texture_width", "texture_height", "level_count")),
        *((name, ctypes.c_double) for name in ("left_px", "top_px", "near_mm")),
    )


class RasterRenderer:
    """One object, ready to be drawn under any light. Not for two threads at once."""

    def __init__(
        self,
        mesh: Mesh,
        transfer: Transfer,
        gloss_rows: NDArray[np.float32],
        roughness: float,
        normal_reflectance: float,
        supersampling: int = 2,
        independent: NDArray[np.float64] | None = None,
        refinement: Refinement | None = None,
    ) -> None:
        """Take down the mesh.

        Args:
            mesh: placed, probe frame [mm].
            transfer: the mesh's own.
            gloss_rows: (side * side, m) of the octahedral map of lobe-averaged radiance.
            roughness: of the gloss, in [0.05, 1].
            normal_reflectance: Fresnel reflectance at normal incidence, 0 for a matte object.
            supersampling: samples along a pixel's side.
            independent: as `LightRows` takes it, to predict coefficients that are not given.
            refinement: of the mesh: what is drawn, and projected for it, in the mesh's place.
        """
        self._rows = LightRows([transfer.vertex_rows, gloss_rows], independent)
        lit_count, openness = len(mesh.vertices_mm), transfer.openness
        ends = np.empty((0, 2), np.int32)
        if refinement is not None:
            mesh, ends, openness = refinement.mesh, refinement.ends, refinement.carried(openness)
        n = len(mesh.vertices_mm)
        planes: dict[str, NDArray[np.floating]] = {"position_mm": mesh.vertices_mm, "normal": mesh.normals}
        planes["openness"] = openness
        self._shading = _Shading(
            count=n, lit_count=lit_count, side=GLOSS_SIDE, roughness=roughness, normal_reflectance=normal_reflectance
        )
        self._shading.hold(
            {name: np.ascontiguousarray(values.T, np.float32) for name, values in planes.items()}
            | {"base_colour": np.column_stack([mesh.base_colour, np.zeros(n)]).astype(np.float32)}
            | {"ends": np.ascontiguousarray(ends), "scratch": np.empty((4, n), np.float32)}
        )
        lit = {"body": np.empty((n, 4), np.float32), "mirrored": np.empty((n, 4), np.float32)}
        self._shading.hold(lit)
        # the list of faces is written one beyond its end
        room = len(mesh.faces) + 1
        self._raster = _Raster(vertex_count=n, face_count=len(mesh.faces), closed=mesh.closed, room=room)
        self._raster.hold({name: np.empty((2, room), np.int32) for name in ("listed", "kept")})
        self._raster.hold({"sorted": np.empty(room, np.int32)})
        self.supersampling = supersampling
        """Samples along a pixel's side; may change from picture to picture."""
        corners = np.zeros((n, _CORNER), np.float32)
        self._raster.hold(lit | {"faces": np.ascontiguousarray(mesh.faces, np.int32), "corners": corners})
        if mesh.textures is not None and mesh.uv is not None and mesh.layer is not None:
            self._hold_textures(mesh.textures, np.column_stack([mesh.uv, mesh.layer]))
        self._drawn, self._band_ends = np.empty(0, np.float32), np.empty(0, np.int32)

    def draw(self, view: View, packed: NDArray[np.float32]) -> Image:
        """One picture of the object.

        Args:
            view: where the camera sees it.
            packed: (k, 3) real-packed coefficients, the first of m.

        Returns:
            (h, w, 4) linear radiance times coverage, and coverage, of the view's region; holds until the next call.
        """
        self._shade(view, packed)
        raster, region, samples = self._raster, view.region, self.supersampling
        raster.samples = samples
        width, height = region.size
        raster.pixels = address(view.projected.pixels, np.float32)
        raster.depth_mm = address(view.projected.depth_mm, np.float32)
        raster.near_mm, raster.left_px = view.projected.near_mm, region.x0
        raster.width, raster.height, raster.top_px = width * samples, height * samples, region.y0
        self._reserve(4 * width * height)
        _draw(ctypes.byref(raster), address(self._drawn, np.float32))
        return self._drawn[: 4 * width * height].reshape(height, width, 4)

    def release(self) -> None:
        """Nothing to give back."""

    def _shade(self, view: View, packed: NDArray[np.float32]) -> None:
        shading = self._shading
        matte, gloss = self._rows.light(packed)
        shading.lit, shading.gloss = address(matte, np.float32), address(gloss, np.float32)
        shading.eye_mm[:] = view.camera_from_probe.camera_centre_mm.tolist()
        _shade(ctypes.byref(shading))

    def _hold_textures(self, images: NDArray[np.uint8], places: NDArray[np.float32]) -> None:
        """Halve the images (layers, h, w, 3) down to a pixel; places (n, 3) are u, v, layer."""
        # row 0 of a texture is v = 0, the image's bottom
        levels = [np.ascontiguousarray(images[:, ::-1])]
        while max(levels[-1].shape[1:3]) > 1:
            height, width = (max(side // 2, 1) for side in levels[-1].shape[1:3])
            levels.append(np.stack([cv2.resize(i, (width, height), interpolation=cv2.INTER_AREA) for i in levels[-1]]))
        raster = self._raster
        raster.layers, raster.texture_height, raster.texture_width = images.shape[:3]
        raster.level_count = len(levels)
        raster.hold(
            {
                "levels": np.concatenate([level.reshape(-1) for level in levels]),
                "linear": linear_from_encoded(np.arange(256) / 255.0).astype(np.float32),
                "texture_place": np.ascontiguousarray(places, np.float32),
            }
        )

    def _reserve(self, values: int) -> None:
        """Room for the samples of a band and for the picture; it only grows."""
        raster = self._raster
        pixel_rows = max(_BAND_SAMPLES // (raster.width * raster.samples), 1)
        raster.band_rows = pixel_rows * raster.samples
        raster.bands = -(-raster.height // raster.band_rows)
        if raster.plane < raster.width * raster.band_rows + _SIDE_BY_SIDE:
            raster.plane = plane = raster.width * raster.band_rows + _SIDE_BY_SIDE
            raster.hold({"planes": np.empty((4, plane), np.float32)})
        if len(self._band_ends) < raster.bands:
            self._band_ends = np.empty(raster.bands, np.int32)
            raster.hold({"band_ends": self._band_ends})
        if len(self._drawn) < values:
            self._drawn = np.empty(values, np.float32)
