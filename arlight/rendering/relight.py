"""Lights an object on the sheet with estimated coefficients and sets it into the frame."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.estimation.lighting import Lighting
from arlight.fourier import orders_up_to, pack_real
from arlight.optics import Slab
from arlight.rendering.composite import cover, shade_plane
from arlight.rendering.draw import ObjectRenderer
from arlight.rendering.gloss import gloss_rows
from arlight.rendering.mesh import Mesh
from arlight.rendering.projection import View, project, union
from arlight.rendering.reconstruction import reconstruct
from arlight.rendering.settings import RelightSettings
from arlight.rendering.transfer import precompute_transfer
from arlight.rendering.visibility import Progress
from arlight.video.frame import Frame, Region

_DARKENING = 0.008
"""A shadow that takes less than this share of the light is below one 8-bit level, and pixels of less are left alone."""


class ObjectDrawer(Protocol):
    """What draws the object; belongs to the thread that made it."""

    def draw(self, view: View, packed: NDArray[np.float32]) -> NDArray[np.float32]:
        """Linear premultiplied radiance and coverage (h, w, 4) of the view's region, by packed coefficients (m, 3)."""

    def release(self) -> None:
        """Give the context back."""


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

    `render` opens an OpenGL context in the thread that first calls it and refuses other threads from then on;
    building it in one thread and rendering in another is fine.
    """

    def __init__(
        self,
        mesh: Mesh,
        probe: ProbeGlass,
        camera: Camera,
        settings: RelightSettings | None = None,
        progress: Progress | None = None,
        order: int | None = None,
    ) -> None:
        """Cast the object's shadows and fold them into matrices; takes seconds.

        Args:
            mesh: any object; it is scaled and placed by the settings.
            probe: the sheet; gives the glass and the frequencies of the coefficients.
            camera: intrinsics of the frames to come.
            settings: placement, material, sampling.
            progress: called with the share of the precomputation done, from 0 to 1.
            order: highest order of the lightings to come, as in `TrackerSettings`; the sheet's by default.

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
        self.mesh = mesh.placed(s.size_mm, s.position_mm, s.yaw_deg)
        self._reconstruction = reconstruct(probe.slab, self._frequencies, s.surroundings_albedo)
        self.transfer = precompute_transfer(self.mesh, self._reconstruction, s.directions, s.shadow_texels, progress)
        self._opened: ObjectDrawer | None = None

    def render(self, frame: Frame, camera_from_probe: Pose | None, lighting: Lighting | None) -> Frame:
        """The frame with the lit object in it.

        Args:
            frame: the recorded frame.
            camera_from_probe: the pose; None where the sheet is lost.
            lighting: the light; None before the first estimate.

        Returns:
            A new frame; the one given where pose or light is missing: nothing is drawn that is not lit by measurement.

        Raises:
            ValueError: frame or lighting do not fit what the relighter was made for.
            RuntimeError: called from another thread than before.
        """
        if camera_from_probe is None or lighting is None:
            return frame
        if frame.size != self._camera.image_size:
            raise ValueError(f"the camera is for frames of {self._camera.image_size} pixels, found {frame.size}")
        packed = self._packed(lighting)
        ratio = self.transfer.shadow.ratio(packed)
        view = self._view(camera_from_probe)
        region = union(None if view is None else view.region, self._shadow_region(camera_from_probe, ratio))
        if region is None:
            return frame
        linear = frame.linear_rgb(region)
        shade_plane(linear, region, self._camera, camera_from_probe, self.transfer.shadow.grid, ratio)
        if view is not None:
            drawn = self._drawer().draw(view, packed)
            cover(linear, view.region.x0 - region.x0, view.region.y0 - region.y0, drawn)
        return frame.with_linear_rgb(region, linear)

    def draw_object(self, camera_from_probe: Pose, lighting: Lighting) -> tuple[Region, NDArray[np.float32]] | None:
        """The object alone: its region of the frame, and linear premultiplied radiance and coverage (h, w, 4) there."""
        view = self._view(camera_from_probe)
        return None if view is None else (view.region, self._drawer().draw(view, self._packed(lighting)))

    def release(self) -> None:
        """Close the OpenGL context, from the thread that renders; it is opened again when needed."""
        if self._opened is not None:
            self._opened.release()
            self._opened = None

    def _view(self, camera_from_probe: Pose) -> View | None:
        projected = project(self._camera, camera_from_probe, self.mesh.vertices_mm)
        region = projected.region()
        return None if region is None else View(camera_from_probe, projected, region)

    def _drawer(self) -> ObjectDrawer:
        if self._opened is None:
            s = self.settings
            if s.renderer == "pyrender":
                # here, because what it needs takes long to load and it is seldom asked for
                from arlight.rendering.pyrender_drawer import PyrenderDrawer

                self._opened = PyrenderDrawer(self.mesh, self._reconstruction, self._camera, s.roughness)
            else:
                rows = gloss_rows(self._reconstruction, s.roughness)
                self._opened = ObjectRenderer(
                    self.mesh, self.transfer, rows, s.roughness, s.normal_reflectance, s.supersampling
                )
        return self._opened

    def _packed(self, lighting: Lighting) -> NDArray[np.float32]:
        if not np.array_equal(lighting.frequencies, self._frequencies):
            raise ValueError(
                f"the lighting has {len(lighting.frequencies)} frequencies that are not the relighter's "
                f"{len(self._frequencies)}; make it with the probe and the order that the lighting was estimated with"
            )
        return pack_real(lighting.coefficients).astype(np.float32)

    def _shadow_region(self, camera_from_probe: Pose, ratio: NDArray[np.float32]) -> Region | None:
        """Pixels that see the darkened part of the plane."""
        dark = np.any(ratio < 1.0 - _DARKENING, axis=2)
        rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
        if len(rows) == 0:
            return None
        grid = self.transfer.shadow.grid
        x = grid.corner_mm[0] + np.array([columns[0] - 0.5, columns[-1] + 1.5]) * grid.texel_mm
        y = grid.corner_mm[1] + np.array([rows[0] - 0.5, rows[-1] + 1.5]) * grid.texel_mm
        # the outline in steps: a lens bends it
        share = np.linspace(0.0, 1.0, 9)
        along_x, along_y = x[0] + share * (x[1] - x[0]), y[0] + share * (y[1] - y[0])
        outline = [(px, py, 0.0) for px in along_x for py in y] + [(px, py, 0.0) for py in along_y for px in x]
        return project(self._camera, camera_from_probe, outline).region(margin_px=1)
