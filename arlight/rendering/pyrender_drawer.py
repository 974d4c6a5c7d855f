"""The object through pyrender: extracted directional lights with shadow maps, for materials that need its shading.

Two things of pyrender 0.1.45 are mended here, for it alone: it asks for `numpy.infty`, which NumPy 2 has dropped, and
when it lets its context go it terminates the EGL display that every other context of the process lives on.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from types import ModuleType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera
from arlight.errors import RenderingUnavailableError
from arlight.rendering.directional import directional_lights
from arlight.rendering.mesh import Mesh
from arlight.rendering.projection import View
from arlight.rendering.reconstruction import Reconstruction

Image = NDArray[np.float32]

_ENCODING_POWER = 2.2
"""pyrender encodes its output with this power."""
_BODY_SHARE = 0.96
"""Share of the base colour that pyrender gives to the matte body of a dielectric lit by a directional light."""
_TILE_PX = 64
"""Viewports are rounded up to this, so that their buffers are not made anew in every frame."""


class PyrenderDrawer:
    """A pyrender scene of one object. It belongs to the thread that made it and refuses the others."""

    def __init__(self, mesh: Mesh, reconstruction: Reconstruction, camera: Camera, roughness: float) -> None:
        """Build the scene.

        Args:
            mesh: placed, probe frame [mm].
            reconstruction: the matrix from coefficients to radiance.
            camera: intrinsics.
            roughness: perceptual roughness.

        Raises:
            RenderingUnavailableError: pyrender or its OpenGL platform cannot be loaded.
        """
        self.supersampling = 1
        """Without effect: pyrender samples a pixel in its own way."""
        self._thread = threading.get_ident()
        self._reconstruction, self._camera = reconstruction, camera
        self._pyrender = _load_pyrender()
        self._scene = self._pyrender.Scene(bg_color=[0.0, 0.0, 0.0, 0.0])
        self._scene.add(self._pyrender.Mesh(_primitives(self._pyrender, mesh, roughness)))
        self._moving: list[Any] = []
        with _current_context_kept():
            self._offscreen = _offscreen(self._pyrender)

    def draw(self, view: View, packed: NDArray[np.float32]) -> Image:
        """Linear premultiplied radiance and coverage (h, w, 4) of the view's region, from packed coefficients (m, 3).

        Raises:
            RuntimeError: called from another thread than the one that made it.
        """
        if threading.get_ident() != self._thread:
            raise RuntimeError("an OpenGL context belongs to its thread: draw from the thread that made the renderer")
        self._place_lights(packed)
        rays = self._camera.ray_map[view.region.y0 : view.region.y1, view.region.x0 : view.region.x1]
        k = self._camera.camera_matrix
        # pixels of an undistorted camera with the same focal lengths
        place = np.stack([rays[..., 0] * k[0, 0] + k[0, 2], rays[..., 1] * k[1, 1] + k[1, 2]], axis=-1)
        corner = np.floor(place.min(axis=(0, 1))) - 1.0
        size = np.ceil(place.max(axis=(0, 1))) + 2.0 - corner
        drawn = self._render(view, corner, [int(-(-s // _TILE_PX) * _TILE_PX) for s in size])
        sought = (place - corner).astype(np.float32)
        return np.asarray(cv2.remap(drawn, sought[..., 0], sought[..., 1], cv2.INTER_LINEAR))

    def release(self) -> None:
        """Give the context back; the drawer cannot be used after."""
        with _current_context_kept():
            self._offscreen.delete()

    def _place_lights(self, packed: NDArray[np.float32]) -> None:
        for node in self._moving:
            self._scene.remove_node(node)
        lights = directional_lights(self._reconstruction, packed)
        # the ambient term is not reduced by the gloss, unlike the lights
        self._scene.ambient_light = lights.ambient_radiance * _BODY_SHARE
        self._moving = []
        for direction, irradiance in zip(lights.directions, lights.irradiance, strict=True):
            peak = float(irradiance.max())
            if peak > 0.0:
                light = self._pyrender.DirectionalLight(color=irradiance / peak, intensity=peak)
                self._moving.append(self._scene.add(light, pose=_looking_along(-direction)))

    def _render(self, view: View, corner: NDArray[np.float64], size: list[int]) -> Image:
        k, pose = self._camera.camera_matrix, view.camera_from_probe
        near = view.projected.near_mm
        far = 2.0 * float(view.projected.depth_mm.max()) + near
        # pyrender's pixel (0, 0) has its centre at one half
        camera = self._pyrender.IntrinsicsCamera(
            k[0, 0], k[1, 1], k[0, 2] + 0.5 - corner[0], k[1, 2] + 0.5 - corner[1], znear=near, zfar=far
        )
        probe_from_eye = np.eye(4)
        # pyrender's camera looks along -z with y up
        probe_from_eye[:3, :3] = pose.rotation.T * [1.0, -1.0, -1.0]
        probe_from_eye[:3, 3] = pose.camera_centre_mm
        node = self._scene.add(camera, pose=probe_from_eye)
        self._scene.main_camera_node = node
        self._offscreen.viewport_width, self._offscreen.viewport_height = size
        flags = self._pyrender.RenderFlags
        with _current_context_kept():
            encoded, _ = self._offscreen.render(self._scene, flags=flags.RGBA | flags.SHADOWS_DIRECTIONAL)
        self._scene.remove_node(node)
        coverage = encoded[..., 3:].astype(np.float32) / 255.0
        # samples were averaged encoded and over black: undo the black first, decode, and premultiply anew
        pure = encoded[..., :3].astype(np.float32) / 255.0 / np.maximum(coverage, 1.0 / 255.0)
        return np.concatenate([np.minimum(pure, 1.0) ** _ENCODING_POWER * coverage, coverage], axis=-1)


def _load_pyrender() -> Any:
    """pyrender, set to EGL unless the caller chose a platform, and mended for NumPy 2."""
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    try:
        import pyrender
    except (ImportError, AttributeError, OSError) as error:
        raise RenderingUnavailableError(
            f"pyrender could not be loaded ({error}); install it and libegl1, or use --renderer moderngl"
        ) from error
    if not hasattr(np, "infty"):
        mended = ModuleType("numpy")
        mended.__dict__.update(np.__dict__, infty=np.inf)
        pyrender.mesh.np = mended
    return pyrender


def _offscreen(pyrender: Any) -> Any:
    """An off-screen renderer whose end destroys its own context and no more."""
    from OpenGL.error import Error as OpenGLError

    try:
        offscreen = pyrender.OffscreenRenderer(_TILE_PX, _TILE_PX)
    # pyrender asserts that EGL answers, PyOpenGL looks up functions of a library that may be missing
    except (OpenGLError, AssertionError, AttributeError, ImportError, OSError, ValueError) as error:
        raise RenderingUnavailableError(
            f"pyrender found no OpenGL through EGL ({error}); install libegl1 or use --renderer moderngl"
        ) from error
    platform = offscreen._platform
    if os.environ["PYOPENGL_PLATFORM"] == "egl":
        platform.delete_context = partial(_destroy_context, platform)
    return offscreen


def _destroy_context(platform: Any) -> None:
    from OpenGL import EGL

    if platform._egl_context is not None:
        EGL.eglMakeCurrent(platform._egl_display, EGL.EGL_NO_SURFACE, EGL.EGL_NO_SURFACE, EGL.EGL_NO_CONTEXT)
        EGL.eglDestroyContext(platform._egl_display, platform._egl_context)
        platform._egl_context = None


@contextmanager
def _current_context_kept() -> Iterator[None]:
    """Make the EGL context that was current before current again: pyrender leaves its own."""
    from OpenGL import EGL
    from OpenGL.error import GLError

    display, context = EGL.eglGetCurrentDisplay(), EGL.eglGetCurrentContext()
    draw, read = EGL.eglGetCurrentSurface(EGL.EGL_DRAW), EGL.eglGetCurrentSurface(EGL.EGL_READ)
    try:
        yield
    finally:
        if context:
            # a context that its owner has destroyed meanwhile stays current by name only
            with suppress(GLError):
                EGL.eglMakeCurrent(display, draw, read, context)


def _primitives(pyrender: Any, mesh: Mesh, roughness: float) -> list[Any]:
    """One primitive per texture layer, or one with vertex colours alone."""
    if mesh.textures is None or mesh.layer is None or mesh.uv is None:
        groups = [(mesh.faces, None)]
    else:
        layer = np.rint(mesh.layer[mesh.faces[:, 0]]).astype(int)
        groups = [(mesh.faces[layer == i], texture) for i, texture in enumerate(mesh.textures)]
    return [
        pyrender.Primitive(
            positions=mesh.vertices_mm.astype(np.float32),
            normals=mesh.normals.astype(np.float32),
            indices=faces.astype(np.uint32),
            color_0=np.c_[mesh.base_colour, np.ones(len(mesh.base_colour))].astype(np.float32),
            texcoord_0=None if texture is None else mesh.uv,
            material=pyrender.MetallicRoughnessMaterial(
                baseColorTexture=None if texture is None else np.ascontiguousarray(texture),
                metallicFactor=0.0,
                roughnessFactor=roughness,
                doubleSided=not mesh.closed,
            ),
        )
        for faces, texture in groups
        if len(faces) > 0
    ]


def _looking_along(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) pose whose -z axis points along a unit direction."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < 0.7 else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, -direction)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(-direction, x), -direction], axis=-1)
    return pose
