"""Lights an object on the sheet with estimated coefficients and sets it into the frame."""

from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.effort import Effort
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need
from arlight.fourier import orders_up_to, pack_real
from arlight.optics import Slab
from arlight.rendering.appearance import Appearance, appearance
from arlight.rendering.composite import PlaneShader
from arlight.rendering.gloss import gloss_rows
from arlight.rendering.light_rows import LightRows
from arlight.rendering.mesh import Mesh
from arlight.rendering.projection import Projector, View
from arlight.rendering.raster import RasterRenderer
from arlight.rendering.reconstruction import reconstruct
from arlight.rendering.refinement import refined
from arlight.rendering.settings import RelightSettings
from arlight.rendering.shadow import Darkening
from arlight.rendering.transfer_cache import kept_transfer
from arlight.rendering.visibility import Progress
from arlight.video.dimming import node_box
from arlight.video.frame import Frame, Layer, Region, Shade

_FAINT = 0.008
"""A shadow that takes less than this share of the light is below one 8-bit level, and pixels of less are left alone."""

_TOLERANCE = 0.04
"""Share by which a lower order of the light may raise the error of the picture."""


class ObjectDrawer(Protocol):
    """What draws the object; one that uses OpenGL belongs to the thread that made it."""

    supersampling: int
    """Samples along a pixel's side."""

    def draw(self, view: View, packed: NDArray[np.float32]) -> NDArray[np.float32]:
        """Linear premultiplied radiance and coverage (h, w, 4) of the view's region, by packed coefficients (m, 3).

        It holds until the next call.
        """

    def release(self) -> None:
        """Give back what it holds."""


class ProbeGlass(Protocol):
    """What of a probe the light's reconstruction depends on."""

    @property
    def slab(self) -> Slab:
        """The glass between film and paper."""

    @property
    def frequencies(self) -> NDArray[np.int64]:
        """(k, 2) frequencies that the sheet measures."""


class Relighter:
    """An object on the sheet, ready to be lit: everything that does not depend on the light or the view is done once.

    It may be built in one thread and used in another, but not by two at once. With a renderer that uses OpenGL the
    thread that first calls `render` owns the context, and others are refused from then on.
    """

    def __init__(
        self,
        mesh: Mesh,
        probe: ProbeGlass,
        camera: Camera,
        settings: RelightSettings | None = None,
        progress: Progress | None = None,
        order: int | None = None,
        cache_folder: Path | None = None,
    ) -> None:
        """Cast the object's shadows and fold them into matrices.

        Args:
            mesh: any object; it is scaled and placed by the settings.
            probe: the sheet; gives the glass and the frequencies of the coefficients.
            camera: intrinsics of the frames to come.
            settings: placement, material, sampling.
            progress: called with the share of the precomputation done, from 0 to 1.
            order: highest order of the lightings to come, as in `TrackerSettings`; the sheet's by default.
            cache_folder: where the object's shadows are kept from one time to the next; None keeps nothing.

        Raises:
            MeshError: the object cannot be placed.
            ProbeError: the sheet does not measure the order.
            RenderingUnavailableError: no headless OpenGL.
        """
        self.settings = settings or RelightSettings()
        s = self.settings
        self._camera = camera
        frequencies = np.asarray(probe.frequencies)
        self._frequencies = frequencies if order is None else frequencies[orders_up_to(frequencies, order)]
        self.mesh = self._fitted(mesh).placed(s.size_mm, s.position_mm, s.yaw_deg)
        self._reconstruction = reconstruct(probe.slab, self._frequencies, s.surroundings_albedo)
        self.transfer = kept_transfer(
            cache_folder, self.mesh, self._reconstruction, s.directions, s.shadow_texels, progress
        )
        shadow = self.transfer.shadow
        self._plane_rows = LightRows([shadow.hidden_rows, shadow.open_row[None]], self._reconstruction.independent)
        self._plane_darkening = Darkening(shadow.grid, _FAINT)
        self._plane_shader = PlaneShader(camera, shadow.grid)
        self._projector = Projector(camera)
        refines = s.renderer == "native" and len(self.mesh.faces) <= s.lit_faces
        self._refinement = refined(self.mesh) if refines else None
        drawn = self.mesh if self._refinement is None else self._refinement.mesh
        self._vertices = np.ascontiguousarray(drawn.vertices_mm, np.float32)
        self._native = self._native_drawer() if s.renderer == "native" else None
        self._opened: ObjectDrawer | None = None
        self._known: NDArray[np.int64] | None = None
        self._darkened: tuple[bytes, NDArray[np.float32]] | None = None

    def render(
        self, frame: Frame, camera_from_probe: Pose | None, lighting: Lighting | None, effort: Effort | None = None
    ) -> Frame:
        """The frame with the lit object in it.

        Args:
            frame: the recorded frame.
            camera_from_probe: the pose; None where the sheet is lost.
            lighting: the light; None before the first estimate. Of the relighter's frequencies it may have the first
                alone, which costs less.
            effort: limits to the work; none by default.

        Returns:
            A new frame; the one given where pose or light is missing: nothing is drawn that is not lit by measurement.

        Raises:
            ValueError: frame or lighting do not fit what the relighter was made for.
            RuntimeError: called from another thread than before, with a renderer that uses OpenGL.
        """
        if camera_from_probe is None or lighting is None:
            return frame
        if frame.size != self._camera.image_size:
            raise ValueError(f"the camera is for frames of {self._camera.image_size} pixels, found {frame.size}")
        effort, packed = effort or Effort(), self._packed(lighting)
        shade = self._shade(frame, camera_from_probe, packed) if effort.shadow else None
        view = self._view(camera_from_probe)
        layer = None if view is None else Layer(view.region, self._draw(view, packed, effort.supersampling))
        return frame if shade is None and layer is None else frame.composed(shade, layer)

    def _shade(self, frame: Frame, camera_from_probe: Pose, packed: NDArray[np.float32]) -> Shade | None:
        """The shadow on the plane."""
        ratio = self._darkening(packed)
        region = self._shadow_region(camera_from_probe)
        if region is None:
            return None
        region = Region(*node_box(region, frame.size))
        return Shade(region, self._plane_shader.left(region, camera_from_probe, ratio))

    def _darkening(self, packed: NDArray[np.float32]) -> NDArray[np.float32]:
        """(side, side, 4) what the object leaves of the plane's light, faint shadow aside."""
        content = packed.tobytes()
        # light that is not measured in every frame is often that of the last one
        if self._darkened is None or content != self._darkened[0]:
            hidden, open_plane = self._plane_rows.light(packed)
            self._darkened = content, self._plane_darkening.ratio(hidden, open_plane[0, :3])
        return self._darkened[1]

    def draw_object(self, camera_from_probe: Pose, lighting: Lighting) -> tuple[Region, NDArray[np.float32]] | None:
        """The object alone: its region of the frame, and linear premultiplied radiance and coverage (h, w, 4) there."""
        view = self._view(camera_from_probe)
        return None if view is None else (view.region, self._draw(view, self._packed(lighting)).copy())

    @cached_property
    def appearance(self) -> Appearance:
        """How much of the picture each coefficient of the light makes; worked out when first asked for."""
        s = self.settings
        return appearance(
            self.mesh, self.transfer, self._gloss_rows, s.roughness, s.normal_reflectance, self._frequencies
        )

    @cached_property
    def need(self) -> Need:
        """What of the light the object shows, from which the order that it requires follows."""
        return Need(self._reconstruction.independent, self.appearance.gram, _TOLERANCE)

    def release(self) -> None:
        """Give back what drawing holds, from the thread that renders; it is made again when needed."""
        if self._opened is not None:
            self._opened.release()
            self._opened = None

    def _view(self, camera_from_probe: Pose) -> View | None:
        projected = self._projector.project(camera_from_probe, self._vertices)
        region = projected.region()
        return None if region is None else View(camera_from_probe, projected, region)

    def _draw(self, view: View, packed: NDArray[np.float32], supersampling: int | None = None) -> NDArray[np.float32]:
        drawer: ObjectDrawer | None = self._native or self._opened
        if drawer is None:
            drawer = self._opened = self._open()
        drawer.supersampling = min(supersampling or self.settings.supersampling, self.settings.supersampling)
        if self._native is None and len(packed) < len(self._reconstruction.independent):
            packed = self._reconstruction.completed(packed).astype(np.float32)
        return drawer.draw(view, packed)

    @cached_property
    def _gloss_rows(self) -> NDArray[np.float32]:
        return gloss_rows(self._reconstruction, self.settings.roughness)

    def _native_drawer(self) -> RasterRenderer:
        s = self.settings
        material = (self._gloss_rows, s.roughness, s.normal_reflectance, s.supersampling)
        return RasterRenderer(self.mesh, self.transfer, *material, self._reconstruction.independent, self._refinement)

    def _open(self) -> ObjectDrawer:
        s = self.settings
        # imported here, because what they need takes long to load
        if s.renderer == "pyrender":
            from arlight.rendering.pyrender_drawer import PyrenderDrawer

            return PyrenderDrawer(self.mesh, self._reconstruction, self._camera, s.roughness)
        from arlight.rendering.draw import ObjectRenderer

        material = (self._gloss_rows, s.roughness, s.normal_reflectance, s.supersampling)
        return ObjectRenderer(self.mesh, self.transfer, *material)

    def _fitted(self, mesh: Mesh) -> Mesh:
        """The mesh, simplified if there are more triangles than are to be drawn."""
        budget = self.settings.mesh_faces
        if budget is None or len(mesh.faces) <= budget:
            return mesh
        # here, because it loads what reads meshes
        from arlight.rendering.tessellation import fit_to_budget

        # a closed surface has half as many vertices
        return fit_to_budget(mesh, max(budget // 2, 4))

    def _packed(self, lighting: Lighting) -> NDArray[np.float32]:
        count = len(lighting.frequencies)
        if lighting.frequencies is not self._known and not np.array_equal(
            lighting.frequencies, self._frequencies[:count]
        ):
            raise ValueError(
                f"the lighting has {count} frequencies that are not the first of the relighter's "
                f"{len(self._frequencies)}; make it with the probe and the order that the lighting was estimated with"
            )
        self._known = lighting.frequencies
        return pack_real(lighting.coefficients).astype(np.float32)

    def _shadow_region(self, camera_from_probe: Pose) -> Region | None:
        """Pixels that see the part of the plane that was darkened last."""
        outline = self._plane_darkening.outline_mm()
        return None if outline is None else self._projector.project(camera_from_probe, outline).region(margin_px=1)
