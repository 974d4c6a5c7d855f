"""Drawing as users do it who do not cut it down to the object: the whole frame, by OpenGL or by pyrender."""

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.estimation.lighting import Lighting
from arlight.fourier import pack_real
from arlight.probe.design import Probe
from arlight.rendering.draw import ObjectRenderer
from arlight.rendering.gloss import gloss_rows
from arlight.rendering.projection import View, project
from arlight.rendering.pyrender_drawer import PyrenderDrawer
from arlight.rendering.reconstruction import reconstruct
from arlight.rendering.relight import ObjectDrawer, Relighter
from arlight.video.frame import Frame, Region


class WholeFrameDrawing:
    """A drawer that is asked for the whole frame, always."""

    def __init__(self, relighter: Relighter, camera: Camera, drawer: ObjectDrawer) -> None:
        self._relighter, self._camera, self._drawer = relighter, camera, drawer

    def draw(self, pose: Pose, lighting: Lighting) -> NDArray[np.float32]:
        """Linear premultiplied radiance and coverage (h, w, 4) of the frame."""
        projected = project(self._camera, pose, self._relighter.mesh.vertices_mm)
        view = View(pose, projected, Region(0, 0, *self._camera.image_size))
        return self._drawer.draw(view, pack_real(lighting.coefficients).astype(np.float32))

    def release(self) -> None:
        """Give the context back."""
        self._drawer.release()


def opengl_drawing(relighter: Relighter, probe: Probe, camera: Camera) -> WholeFrameDrawing:
    """OpenGL with the relighter's own object and anti-aliasing.

    Raises:
        RenderingUnavailableError: there is no headless OpenGL.
    """
    s = relighter.settings
    rows = gloss_rows(reconstruct(probe.slab, probe.frequencies, s.surroundings_albedo), s.roughness)
    drawer = ObjectRenderer(
        relighter.mesh, relighter.transfer, rows, s.roughness, s.normal_reflectance, s.supersampling
    )
    return WholeFrameDrawing(relighter, camera, drawer)


def pyrender_drawing(relighter: Relighter, probe: Probe, camera: Camera) -> WholeFrameDrawing:
    """pyrender with directional lights and their shadow maps.

    Raises:
        RenderingUnavailableError: pyrender or its OpenGL cannot be loaded.
    """
    s = relighter.settings
    reconstruction = reconstruct(probe.slab, probe.frequencies, s.surroundings_albedo)
    return WholeFrameDrawing(relighter, camera, PyrenderDrawer(relighter.mesh, reconstruction, camera, s.roughness))


def convert_whole_frame(frame: Frame) -> NDArray[np.uint8]:
    """A 4:2:0 frame to RGB and back by OpenCV, as one who composites in RGB converts it."""
    width, height = frame.size
    planes = np.concatenate([plane.ravel() for plane in frame.planes]).reshape(height * 3 // 2, width)
    return np.asarray(cv2.cvtColor(cv2.cvtColor(planes, cv2.COLOR_YUV2RGB_I420), cv2.COLOR_RGB2YUV_I420), np.uint8)
