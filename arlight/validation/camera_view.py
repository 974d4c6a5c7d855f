"""What a camera sees of the lit sheet: the matte paper's light through glass and film, mirrored light in both faces.

The paper's light does not depend on the viewer, so a camera path only branches at the faces of the glass; every branch
is followed with its weight, none is chosen by chance. Fresnel's reflectance comes from Mitsuba.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.probe.design import Probe
from arlight.synthetic.sheet import sharpen_for_bilinear
from arlight.validation.assembled_layers import AssembledLayers
from arlight.validation.camera_kernels import draw, look_from_points
from arlight.validation.paper_light import radiosity
from arlight.validation.stack_paths import interface_reflectance_table

Array = NDArray[np.float64]
Image = NDArray[np.float32]

TABLE_REFLECTANCE = 0.3
_MARGIN_PX = 4


@dataclass(frozen=True)
class LitSheet:
    """A sheet under some lights, ready to be looked at."""

    film: Image
    """(rows, columns) transmittance of the film at every second fine sample, sharpened for bilinear reading."""
    paper: Image
    """(rows, columns, channels) radiosity of the paper there, alike."""
    frame: Image
    """Reflectance of the frame, negative in its window."""
    texture_frame: Array
    """(6,) first sample's x and y [mm], samples per mm, frame's half width and height [mm], its pixels per mm."""
    offset: Array
    """(2,) thickness of the glass [mm] and its refractive index."""
    reflectance: Array
    """Fresnel's reflectance of one face over the cosine in air."""
    environments: tuple[Environment, ...]
    """The lights."""
    open_irradiance: Array
    """(channels,) of the frame and the table [radiance * sr]."""

    @classmethod
    def of(
        cls, probe: Probe, layers: AssembledLayers, environments: list[Environment], irradiance: Image
    ) -> "LitSheet":
        """Light a sheet.

        Args:
            probe: gives the sheet's outline.
            layers: the assembled sheet.
            environments: the lights.
            irradiance: (environments, 3, rows, columns) of the paper, from `gather_irradiance`.
        """
        paper = radiosity(layers, irradiance.reshape(-1, *irradiance.shape[2:]))
        for channel in range(paper.shape[2]):
            paper[..., channel] = sharpen_for_bilinear(np.ascontiguousarray(paper[..., channel]))
        width, height = probe.sheet_mm
        return cls(
            film=sharpen_for_bilinear(np.ascontiguousarray(layers.film[::2, ::2])),
            paper=paper,
            frame=layers.frame,
            texture_frame=np.array([*layers.first_mm, layers.per_mm / 2, width / 2, height / 2, layers.frame_per_mm]),
            offset=np.array([layers.slab.glass_mm, layers.slab.refractive_index]),
            reflectance=interface_reflectance_table(layers.slab),
            environments=tuple(environments),
            open_irradiance=np.concatenate([environment.irradiance() for environment in environments]),
        )

    def picture(self, camera: Camera, pose: Pose, samples: int = 5, seed: int = 0) -> Image:
        """Linear radiance (environments, h, w, 3), averaged over every pixel's square.

        Args:
            camera: intrinsics and lens distortion.
            pose: camera_from_probe [mm].
            samples: along each side of a pixel, jittered.
            seed: of the jitter.
        """
        width, height = camera.image_size
        channels = self.paper.shape[2]
        table = (TABLE_REFLECTANCE / np.pi * self.open_irradiance).astype(np.float32)
        image = np.broadcast_to(table, (height, width, channels)).copy()
        x0, y0, x1, y1 = self._box(camera, pose)
        if x1 <= x0 or y1 <= y0:
            return self._by_environment(image)
        mirrored = self._mirrored(camera, pose, (x0, y0, x1, y1))
        draw(
            image, (x0, y0), mirrored, camera.ray_map, np.ascontiguousarray(pose.rotation.T), pose.camera_centre_mm,
            self.film, self.paper, self.frame, self.texture_frame, self.offset, self.reflectance,
            (self.open_irradiance / np.pi).astype(np.float32), table, samples, seed,
        )  # fmt: skip
        return self._by_environment(image)

    def radiance(self, points_mm: Array, toward: Array, mirrors: bool = True) -> Array:
        """Radiance (n, channels) that leaves points of the film toward one direction.

        Args:
            points_mm: (n, 2) in the frame's window, probe frame [mm].
            toward: (3,) unit vector to a distant viewer.
            mirrors: whether the glass mirrors the environment beside showing the paper.
        """
        mirrored = np.concatenate([e.radiance_at(toward * [-1.0, -1.0, 1.0]) for e in self.environments])
        out = np.zeros((len(points_mm), self.paper.shape[2]), np.float32)
        tangential = np.asarray(toward[:2], float)
        offset = tangential * self.offset[0] / np.sqrt(self.offset[1] ** 2 - tangential @ tangential)
        face = float(np.interp(toward[2], np.linspace(0.0, 1.0, len(self.reflectance)), self.reflectance))
        look_from_points(
            out, np.asarray(points_mm, float), offset, face, (mirrored * mirrors).astype(np.float32), self.film,
            self.paper, self.texture_frame,
        )  # fmt: skip
        return out.astype(float)

    def _by_environment(self, image: Image) -> Image:
        height, width, channels = image.shape
        return np.ascontiguousarray(image.reshape(height, width, channels // 3, 3).transpose(2, 0, 1, 3))

    def _box(self, camera: Camera, pose: Pose) -> tuple[int, int, int, int]:
        """Pixels x0, y0, x1, y1 around the sheet, the last ones not in it."""
        half = self.texture_frame[3:5]
        along = np.linspace(-1.0, 1.0, 33)
        border = np.concatenate([[(a, s), (s, a)] for a in along for s in (-1.0, 1.0)]) * half
        pixels = camera.project(pose, np.concatenate([border, np.zeros((len(border), 1))], axis=1))
        low = np.clip(np.floor(pixels.min(axis=0)) - _MARGIN_PX, 0, camera.image_size).astype(int)
        high = np.clip(np.ceil(pixels.max(axis=0)) + _MARGIN_PX, 0, camera.image_size).astype(int)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _mirrored(self, camera: Camera, pose: Pose, box: tuple[int, int, int, int]) -> Image:
        """(rows, columns, channels) radiance that arrives from the mirror direction of each pixel's centre."""
        x0, y0, x1, y1 = box
        rays = camera.ray_map[y0:y1, x0:x1].astype(float)
        directions = np.concatenate([rays, np.ones((*rays.shape[:2], 1))], axis=-1) @ pose.rotation
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        mirrored = directions * [1.0, 1.0, -1.0]
        return np.concatenate([e.radiance_at(mirrored) for e in self.environments], axis=-1).astype(np.float32)
