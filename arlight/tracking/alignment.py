"""Direct alignment: the pose at which the known fiducials explain the picture's pixels, in linear light.

Gauss-Newton on the six pose parameters over all fiducials at once. The derivatives come from the template, blurred as
the picture is; each marker's gain, its slope over the marker and a bias are projected out, so that light and shadow do
not pull at the pose.

Source: Baker and Matthews, Lucas-Kanade 20 years on, 2004 (the inverse compositional derivative).
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.tracking.alignment_kernels import FEATURES, LIGHTING, POSE, linearise
from arlight.tracking.lens import camera_parameters
from arlight.tracking.planar_pose import is_seen_from_above
from arlight.tracking.template import FiducialTemplate
from arlight.tracking.template_kernels import render

Array = NDArray[np.float64]

SAMPLING_VARIANCE_PX2 = 1.0 / 12.0 + 1.0 / 6.0
"""Variance of a pixel's square, and on average of interpolating between pixels [px^2]."""
OCCLUDED_BELOW = 0.8
"""Correlation of a marker with its picture below which it counts as occluded."""
WORST_STDDEV_PX = 0.3
"""Largest standard deviation of the sheet's corners at which a pose still counts as determined [px]."""
_BLUR_RANGE_PX = (0.5, 3.0)
_OUTLIER_LIMIT = 0.25
"""Residual, relative to a marker's gain, at which a point's weight is halved."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """What aligning one picture gave."""

    pose: Pose
    """camera_from_probe."""
    correlation: Array
    """(m,) of each marker with its picture; 0 outside the frame."""
    used: NDArray[np.bool_]
    """(m,) markers that the pose rests on."""
    residual_rms_px: float
    """Rms over the used markers of how far each would still move by itself, freed of the fit's own degrees [px]."""
    stddev_px: float
    """Standard deviation of the sheet's corners that follows from noise and the markers' number and place [px]."""
    blur_px: float
    """Standard deviation of the picture's whole blur, pixel and interpolation included [px]."""

    @property
    def accepted(self) -> bool:
        """Whether the markers seen determine the pose: they correlate, and the sheet's corners are not left loose."""
        good = self.correlation[self.used]
        return bool(good.size and np.median(good) > OCCLUDED_BELOW and self.stddev_px < WORST_STDDEV_PX)


@dataclass(frozen=True, slots=True)
class Picture:
    """The part of a frame around the sheet."""

    luma: NDArray[np.uint8]
    """(h, w) luma codes of the region."""
    table: NDArray[np.float32]
    """(256,) linear light of a code."""
    corner_px: tuple[int, int]
    """Where the region begins in the frame (x, y) [px]."""

    def level(self, shrink: int) -> tuple[NDArray[np.uint8], NDArray[np.float32], Array]:
        """Codes at 1/shrink of the resolution, the table, and (x0, y0, scale) for the kernels."""
        window = np.array([self.corner_px[0], self.corner_px[1], 1.0 / shrink])
        if shrink == 1:
            return self.luma, self.table, window
        height, width = (side // shrink for side in self.luma.shape)
        # Whole blocks of pixels only: the scale is then exact.
        whole = self.luma[: height * shrink, : width * shrink]
        small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(small, np.uint8), self.table, window


@dataclass(frozen=True, slots=True)
class _Level:
    """How hard one level of resolution is worked on."""

    steps: int
    """Most Gauss-Newton steps."""
    tolerance_px: float
    """The level ends where a step would move the sheet by less [px]."""
    floors: tuple[float, float]
    """Correlation that a marker needs to take part, in the first step and after."""
    share: int
    """One of so many points is used."""


_FINEST = _Level(8, 0.01, (0.5, OCCLUDED_BELOW), 1)
_COARSER = _Level(5, 0.2, (-1.0, 0.2), 2)
_WIDENING = 1.2
"""Blur of the template on a shrunk picture, in its pixels: wider than the picture's, it reaches farther."""


@dataclass(frozen=True, slots=True)
class _Workspace:
    """Memory for one number of points, contiguous for the compiler's sake; shapes as the kernels name them."""

    index_u: NDArray[np.int64]
    index_v: NDArray[np.int64]
    points: Array
    values: Array
    sharper: Array
    features: Array
    scratch: Array

    @classmethod
    def of_template(cls, template: FiducialTemplate, share: int) -> "_Workspace":
        """For one of `share` points."""
        m, p = template.index_u.shape[0], template.index_u.shape[1] // share
        index_u, index_v = (np.ascontiguousarray(index[:, :p]) for index in (template.index_u, template.index_v))
        points, values, sharper = np.zeros((m, 2, p)), np.zeros((m, 3, p)), np.zeros((m, 3, p))
        return cls(index_u, index_v, points, values, sharper, np.zeros((m, FEATURES, p)), np.zeros((2, p)))


class FiducialAlignment:
    """Aligns the fiducials of a sheet to pictures of it.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera, lens distortion included.
    """

    def __init__(self, probe: Probe, camera: Camera) -> None:
        self._camera = camera
        self._parameters = camera_parameters(camera)
        self._outline = probe.outline_mm
        corners = np.array([marker.corners_mm for marker in probe.markers], float).reshape(-1, 2)
        self._corners = np.column_stack([corners, np.zeros(len(corners))])
        self._radius = float(np.max(np.linalg.norm(corners, axis=1)))
        template = FiducialTemplate.of_probe(probe)
        self._template = template
        places = template.places
        middle = places[:, :2] + template.size / 2.0 * (places[:, 2:4] + places[:, 4:6])
        axes = np.stack([middle, middle + places[:, 2:4], middle + places[:, 4:6]], axis=1)
        self._axes = np.concatenate([axes, np.zeros((*axes.shape[:2], 1))], axis=2)
        m = len(places)
        self._workspaces = {level.share: _Workspace.of_template(template, level.share) for level in (_FINEST, _COARSER)}
        self._coefficients, self._gram = np.zeros((m, LIGHTING)), np.zeros((m, FEATURES, FEATURES))
        self._correlation, self._weight, self._normal = np.zeros(m), np.zeros(m), np.zeros((POSE + 1, POSE + 1))

    def region(self, pose: Pose) -> tuple[int, int, int, int] | None:
        """The part x0, y0, x1, y1 of the frame around the fiducials at a pose; None when they are out of it."""
        if not is_seen_from_above(pose, self._corners):
            return None
        pixels = self._camera.project(pose, self._corners)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high))):
            return None
        margin = 16.0 + 0.06 * np.max(high - low)
        width, height = self._camera.image_size
        x0, y0 = (max(0, math.floor(value - margin)) // 8 * 8 for value in low)
        x1, y1 = (min(size, math.ceil(value + margin)) for value, size in zip(high, (width, height), strict=True))
        return (x0, y0, x1, y1) if x1 - x0 >= 16 and y1 - y0 >= 16 else None

    def align(self, picture: Picture, start: Pose, blur_px: float, coarsest: int) -> Alignment | None:
        """The pose near a first guess at which the fiducials fit the picture.

        Args:
            picture: the region around the sheet.
            start: first guess, to within a few pixels; more with a coarser first level.
            blur_px: standard deviation of the whole blur in the picture [px].
            coarsest: the first level shrinks the picture by this: 1, 2, 4 or 8.

        Returns:
            The alignment, or None where no marker is in sight.
        """
        pose: Pose | None = start
        shrink = coarsest
        while shrink >= 1 and pose is not None:
            pose = self._fit(picture, pose, blur_px, shrink)
            shrink //= 2
        if pose is None or not is_seen_from_above(pose, self._corners):
            return None
        used = self._weight > 0.0
        return Alignment(
            pose=pose,
            correlation=self._correlation.copy(),
            used=used,
            residual_rms_px=self._residual_rms_px(pose, used),
            stddev_px=self._corner_stddev_px(pose),
            blur_px=self._next_blur(blur_px, used),
        )

    def _fit(self, picture: Picture, start: Pose, blur_px: float, shrink: int) -> Pose | None:
        """Gauss-Newton at one resolution; None when no marker takes part."""
        level = _FINEST if shrink == 1 else _COARSER
        drawn_px = blur_px if shrink == 1 else max(blur_px, _WIDENING * shrink)
        work = self._workspaces[level.share]
        self._render(work, start, drawn_px, max(drawn_px, 0.9))
        self._coefficients[:] = 0.0
        codes, table, window = picture.level(shrink)
        rotation, translation = start.rotation, start.translation
        for k in range(level.steps + 1):
            parameters = np.concatenate([np.ravel(rotation), translation])
            used = linearise(
                codes, table, window, self._parameters, parameters, self._template.places, self._template.size,
                work.points, work.values, level.floors[min(k, 1)], _OUTLIER_LIMIT, self._coefficients,
                work.features, work.scratch, self._gram, self._correlation, self._weight, self._normal,
            )  # fmt: skip
            if used == 0:
                return None
            step = _solve(self._normal)
            moved_mm = np.linalg.norm(step[3:]) + self._radius * np.linalg.norm(step[:3])
            if k == level.steps or self._parameters[0] * moved_mm < level.tolerance_px * translation[2]:
                break
            rotation = Pose.from_rvec(step[:3], step[3:]).rotation @ rotation
            translation = translation + step[3:]
        return Pose(rotation, translation)

    def _render(self, work: "_Workspace", pose: Pose, blur_px: float, reach_px: float) -> None:
        """The template as it looks at a pose, blurred on each marker's axes as isotropic blur does there."""
        pixels = self._camera.project(pose, self._axes).reshape(-1, 3, 2)
        along_u, along_v = pixels[:, 1] - pixels[:, 0], pixels[:, 2] - pixels[:, 0]
        area = np.maximum(np.abs(along_u[:, 0] * along_v[:, 1] - along_u[:, 1] * along_v[:, 0]), 1e-9)
        modules_per_px = np.stack([np.hypot(*along_v.T), np.hypot(*along_u.T)], axis=1) / area[:, None]
        self._sigma, self._reach = blur_px * modules_per_px, reach_px * modules_per_px
        self._draw(work, self._sigma, work.values)

    def _draw(self, work: "_Workspace", sigma: Array, values: Array) -> None:
        t = self._template
        render(
            t.black, t.position_base, t.position_spread, work.index_u, work.index_v,
            sigma, self._reach, work.points, values,
        )  # fmt: skip

    def _residual_rms_px(self, pose: Pose, used: NDArray[np.bool_]) -> float:
        """How far the used markers would still move, each by itself, in the camera's x and y."""
        matrix, right = self._gram[used, 7:9, 7:9], self._gram[used, 7:9, 10:] / self._coefficients[used, :1, None]
        depth = pose.transform(self._corners)[:, 2].reshape(-1, 4).mean(axis=1)[used]
        determinant = np.linalg.det(matrix)
        sound = determinant > 1e-12 * np.trace(matrix, axis1=1, axis2=2) ** 2
        shift = np.linalg.solve(matrix[sound], right[sound])[..., 0] * (self._parameters[0] / depth[sound])[:, None]
        freedom = max(shift.size - 6.0, 1.0)
        return math.sqrt(float(np.sum(shift**2)) * 2.0 / freedom)

    def _corner_stddev_px(self, pose: Pose) -> float:
        """Rms standard deviation of the outline's corners, from the inverse of the normal matrix."""
        scale = np.sqrt(np.maximum(np.diag(self._normal)[:POSE], 1e-300))
        try:
            covariance = np.linalg.inv(self._normal[:POSE, :POSE] / np.outer(scale, scale)) / np.outer(scale, scale)
        except np.linalg.LinAlgError:
            return math.inf
        turned = self._outline @ pose.rotation.T
        x, y, z = (turned + pose.translation).T
        zero, one = np.zeros_like(x), np.ones_like(x)
        view = np.stack([one, zero, -x / z, zero, one, -y / z], axis=1).reshape(-1, 2, 3)
        view *= (self._parameters[0] / z)[:, None, None]
        turning = np.stack([-_cross(q) for q in turned])
        jacobian = np.concatenate([view @ turning, view], axis=2)
        variance = float(np.sum((jacobian @ covariance) * jacobian)) / len(x)
        return math.sqrt(variance) if variance >= 0.0 else math.inf

    def _next_blur(self, blur_px: float, used: NDArray[np.bool_]) -> float:
        """One step of the blur's estimate: the change of variance that best explains the pixels near the edges."""
        share, work, part = 0.2, self._workspaces[_FINEST.share], self._workspaces[_COARSER.share]
        self._draw(part, self._sigma * math.sqrt(1.0 - share), part.sharper)
        number = part.sharper.shape[2]
        features, drawn = work.features[used, :, :number], work.values[used, 0, :number]
        light = features[:, LIGHTING + POSE]
        inside = (light >= 0.0)[:, None]
        lighting = features[:, :LIGHTING] * inside
        wanted = np.stack([(drawn - part.sharper[used, 0]) / (share * blur_px**2), light], axis=1) * inside
        gram = lighting @ lighting.transpose(0, 2, 1) + 1e-9 * np.eye(LIGHTING)
        wanted -= (np.linalg.solve(gram, lighting @ wanted.transpose(0, 2, 1))).transpose(0, 2, 1) @ lighting
        per_gain = self._weight[used] / self._coefficients[used, 0]
        above = float(np.sum(per_gain * np.sum(wanted[:, 0] * wanted[:, 1], axis=1)))
        below = float(np.sum(self._weight[used] * np.sum(wanted[:, 0] ** 2, axis=1)))
        change = above / below if below > 0.0 else 0.0
        variance = np.clip(blur_px**2 + change, 0.5 * blur_px**2, 2.0 * blur_px**2)
        return float(np.clip(math.sqrt(variance), *_BLUR_RANGE_PX))


def _solve(normal: Array) -> Array:
    """(6,) the pose's step from its normal equations; directions that they leave open stay at rest."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal)[:POSE], 1e-300))
    matrix = normal[:POSE, :POSE] * np.outer(scale, scale) + 1e-9 * np.eye(POSE)
    return -scale * np.linalg.solve(matrix, scale * normal[:POSE, POSE])


def _cross(q: Array) -> Array:
    """The matrix that takes v to q x v."""
    return np.array([[0.0, -q[2], q[1]], [q[2], 0.0, -q[0]], [-q[1], q[0], 0.0]])
