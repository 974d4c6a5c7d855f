"""What a camera sees of the lit sheet: the matte paper's light through glass and film, mirrored light in both faces.

The paper's light does not depend on the viewer, so a camera path only branches at the faces of the glass; every branch
is followed with its weight, none is chosen by chance. Fresnel's reflectance comes from Mitsuba.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.probe.design import Probe
from arlight.synthetic.sheet import sharpen_for_bilinear
from arlight.validation.assembled_layers import AssembledLayers
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
        _draw(
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
        _look_from_points(
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


@njit(inline="always")
def _bilinear_weights(x, y, rows, columns):  # type: ignore[no-untyped-def]
    """Place and weights of the four samples around (x, y); the place is -1 outside."""
    column, row = int(np.floor(x)), int(np.floor(y))
    if column < 0 or row < 0 or column >= columns - 1 or row >= rows - 1:
        return -1, -1, 0.0, 0.0
    return row, column, np.float32(x - column), np.float32(y - row)


@njit(inline="always")
def _read(image, x, y):  # type: ignore[no-untyped-def]
    row, column, fx, fy = _bilinear_weights(x, y, image.shape[0], image.shape[1])
    if row < 0:
        return np.float32(0.0)
    upper = image[row, column] * (1 - fx) + image[row, column + 1] * fx
    lower = image[row + 1, column] * (1 - fx) + image[row + 1, column + 1] * fx
    return upper * (1 - fy) + lower * fy


@njit(inline="always")
def _add_paper(target, paper, x, y, weight):  # type: ignore[no-untyped-def]
    row, column, fx, fy = _bilinear_weights(x, y, paper.shape[0], paper.shape[1])
    if row < 0:
        return
    weight = np.float32(weight)
    a, b = weight * (1 - fx) * (1 - fy), weight * fx * (1 - fy)
    c, d = weight * (1 - fx) * fy, weight * fx * fy
    p, q = paper[row, column], paper[row, column + 1]
    r, s = paper[row + 1, column], paper[row + 1, column + 1]
    for k in range(target.size):
        target[k] += a * p[k] + b * q[k] + c * r[k] + d * s[k]


@njit(inline="always")
def _look_through(target, x, y, offset, face, mirrored, film, paper, place):  # type: ignore[no-untyped-def]
    """Add the radiance that leaves the upper face at (x, y) [mm] toward the viewer; offset is D(v) [mm]."""
    for k in range(target.size):
        target[k] += np.float32(face) * mirrored[k]
    left, top, per_mm = place[0], place[1], place[2]
    weight = (1.0 - face) * _read(film, (x - left) * per_mm, (top - y) * per_mm)
    for _ in range(6):
        if weight < 1e-5:
            return
        x, y = x - offset[0], y - offset[1]
        _add_paper(target, paper, (x - left) * per_mm, (top - y) * per_mm, weight * (1.0 - face) / np.pi)
        x, y = x - offset[0], y - offset[1]
        passed = _read(film, (x - left) * per_mm, (top - y) * per_mm)
        weight *= face * passed
        for k in range(target.size):
            target[k] += np.float32(weight * (1.0 - face)) * mirrored[k]
        weight *= face * passed


@njit(cache=True, fastmath=True)
def _look_from_points(out, points, offset, face, mirrored, film, paper, place):  # type: ignore[no-untyped-def]
    for i in range(len(points)):
        _look_through(out[i], points[i, 0], points[i, 1], offset, face, mirrored, film, paper, place)


@njit(parallel=True, cache=True, fastmath=True)
def _draw(  # type: ignore[no-untyped-def]
    image, first, mirrored, ray_map, rotation, centre, film, paper, frame, place, glass, reflectance, open_light, table,
    samples, seed,
):  # fmt: skip
    rows, columns, channels = mirrored.shape
    height, width = ray_map.shape[:2]
    for row in prange(rows):
        total = np.zeros(channels, np.float32)
        v = np.zeros(3)
        offset = np.zeros(2)
        y_px = row + first[1]
        state = np.uint32((seed * 9781 + y_px) * 6271 + 12345)
        up, down = max(y_px - 1, 0), min(y_px + 1, height - 1)
        for column in range(columns):
            x_px = column + first[0]
            left, right = max(x_px - 1, 0), min(x_px + 1, width - 1)
            total[:] = 0.0
            for sample in range(samples * samples):
                state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
                jx = (sample % samples + (state >> np.uint32(8)) / 16777216.0) / samples - 0.5
                state = np.uint32(state * np.uint32(1664525) + np.uint32(1013904223))
                jy = (sample // samples + (state >> np.uint32(8)) / 16777216.0) / samples - 0.5
                rx = ray_map[y_px, x_px, 0]
                rx += jx * (ray_map[y_px, right, 0] - ray_map[y_px, left, 0]) / (right - left)
                rx += jy * (ray_map[down, x_px, 0] - ray_map[up, x_px, 0]) / (down - up)
                ry = ray_map[y_px, x_px, 1]
                ry += jx * (ray_map[y_px, right, 1] - ray_map[y_px, left, 1]) / (right - left)
                ry += jy * (ray_map[down, x_px, 1] - ray_map[up, x_px, 1]) / (down - up)
                # toward the viewer
                for axis in range(3):
                    v[axis] = -(rotation[axis, 0] * rx + rotation[axis, 1] * ry + rotation[axis, 2])
                length = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
                v /= length
                x = centre[0] - v[0] * centre[2] / v[2]
                y = centre[1] - v[1] * centre[2] / v[2]
                if v[2] <= 0.0 or abs(x) >= place[3] or abs(y) >= place[4]:
                    for k in range(channels):
                        total[k] += table[k]
                    continue
                on_frame = frame[
                    min(int((place[4] - y) * place[5]), frame.shape[0] - 1),
                    min(int((x + place[3]) * place[5]), frame.shape[1] - 1),
                ]
                if on_frame >= 0.0:
                    for k in range(channels):
                        total[k] += on_frame * open_light[k]
                    continue
                sine_squared = v[0] ** 2 + v[1] ** 2
                stretch = glass[0] / np.sqrt(glass[1] ** 2 - sine_squared)
                offset[0], offset[1] = v[0] * stretch, v[1] * stretch
                at = v[2] * (reflectance.size - 1)
                node = min(int(at), reflectance.size - 2)
                face = reflectance[node] + (at - node) * (reflectance[node + 1] - reflectance[node])
                _look_through(total, x, y, offset, face, mirrored[row, column], film, paper, place)
            image[y_px, x_px, :] = total / np.float32(samples * samples)
