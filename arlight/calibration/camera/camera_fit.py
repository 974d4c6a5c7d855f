"""Intrinsics and poses that explain views of a flat target: bundle adjustment with what is known beforehand.

Robust Gauss-Newton on the reprojection errors. The views' poses are eliminated from the normal equations, so that the
cost grows with the number of views, and what is left is the information on the intrinsics, which gives their
covariance. What is known beforehand, square pixels for instance, enters as an expected value and its deviation.

Source: Triggs et al., Bundle adjustment, a modern synthesis, 2000, section 6.1 (Schur complement).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.tracking.planar_pose import planar_poses

Array = NDArray[np.float64]

NAMES = ("log_focal", "log_aspect", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Parameters in order: log of the vertical focal length, log of horizontal over vertical, principal point, lens."""
_SMALLEST_STDDEV_PX = 0.01
"""No point is known better than this [px]; keeps noise-free input solvable."""
_FOCAL_GUESSES = np.geomspace(0.4, 5.0, 9)
"""First guesses of the focal length, relative to the picture's longer side."""
_GUESSING_VIEWS = 8
_STEPS = 40
_LEAST_IMPROVEMENT = 1e-7


@dataclass(frozen=True, slots=True)
class TargetView:
    """One picture of a flat target."""

    name: str
    """What to call the picture in messages."""
    points_mm: Array
    """(n, 2) points of the target's plane z = 0, n >= 4 [mm]."""
    pixels: Array
    """(n, 2) where they are seen [px]."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """What is known of the intrinsics before looking; in the order of `NAMES`."""

    mean: Array
    """(9,) expected values; focal length as log [px]."""
    stddev: Array
    """(9,) how far from them the values may well be; 0 holds a value, infinity leaves it open."""

    @classmethod
    def of_calibration(cls, image_size: tuple[int, int]) -> "Expectation":
        """For many good views: little is presumed, all five terms of the lens are free."""
        stddev = [np.inf, 0.02, 0.05 * image_size[0], 0.05 * image_size[0], 0.5, 0.5, 0.01, 0.01, 0.5]
        return cls(_centred(image_size), np.array(stddev))

    @classmethod
    def of_footage(cls, image_size: tuple[int, int], pixel_aspect: float = 1.0) -> "Expectation":
        """For any clip: pixels of a stated shape, the principal point near the centre, a lens with little distortion.

        Args:
            image_size: (width, height) [px].
            pixel_aspect: width of a pixel relative to its height.
        """
        mean = _centred(image_size)
        mean[1] = -np.log(pixel_aspect)
        near = 0.006 * max(image_size)
        return cls(mean, np.array([np.inf, 0.0, near, near, 0.12, 0.12, 5e-4, 5e-4, 0.03]))


@dataclass(frozen=True, slots=True)
class CameraFit:
    """Intrinsics, what they leave over, and how well they are determined."""

    camera: Camera
    """The intrinsics."""
    covariance: Array
    """(9, 9) of the parameters in the order of `NAMES`."""
    poses: tuple[Pose, ...]
    """Target to camera, of each view."""
    residuals_px: tuple[Array, ...]
    """(n, 2) seen minus projected, of each view [px]."""
    stddev_px: float
    """Robust standard deviation of a coordinate of a point [px]."""

    @property
    def focal_stddev(self) -> float:
        """Standard deviation of the focal length, relative to it."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def view_rms_px(self) -> Array:
        """(views,) rms reprojection error [px]."""
        return np.array([np.sqrt(np.mean(np.sum(r**2, axis=1))) for r in self.residuals_px])


def fit_camera(
    views: Sequence[TargetView], image_size: tuple[int, int], expected: Expectation, start: Camera | None = None
) -> CameraFit | None:
    """Intrinsics from views of a flat target.

    Args:
        views: at least one, of four points at least.
        image_size: (width, height) [px].
        expected: what is known beforehand.
        start: a first guess of the camera; by default the best of focal lengths from wide to tele.

    Returns:
        The fit, or None where no camera was found from which the views' points could be seen so. Look at its
        covariance: views that do not determine the focal length are no error here.
    """
    camera = start or _best_guess(views, image_size, expected)
    found = None
    for _ in range(3):
        poses = _poses(camera, views)
        if poses is None:
            return found
        found = _adjust(camera, poses, views, expected)
        better = _poses(found.camera, views)
        if better is None or _rms(found.camera, better, views) > 0.98 * _rms(found.camera, found.poses, views):
            break
        # a view had settled in the mirrored one of the plane's two poses
        camera = found.camera
    return found


def camera_of(parameters: Array, image_size: tuple[int, int]) -> Camera:
    """The camera of parameters (9,) in the order of `NAMES`."""
    fy = float(np.exp(parameters[0]))
    fx = fy * float(np.exp(parameters[1]))
    matrix = np.array([[fx, 0.0, parameters[2]], [0.0, fy, parameters[3]], [0.0, 0.0, 1.0]])
    return Camera(image_size, matrix, parameters[4:])


def _centred(image_size: tuple[int, int]) -> Array:
    width, height = image_size
    return np.array([np.log(max(image_size)), 0.0, (width - 1) / 2.0, (height - 1) / 2.0, 0, 0, 0, 0, 0])


def _parameters(camera: Camera) -> Array:
    k = camera.camera_matrix
    lens = np.zeros(5)
    lens[: min(camera.distortion.size, 5)] = camera.distortion[:5]
    return np.concatenate([[np.log(k[1, 1]), np.log(k[0, 0] / k[1, 1]), k[0, 2], k[1, 2]], lens])


def _best_guess(views: Sequence[TargetView], image_size: tuple[int, int], expected: Expectation) -> Camera:
    few = views[:: max(1, len(views) // _GUESSING_VIEWS)]
    guesses, errors = [], []
    for focal in _FOCAL_GUESSES * max(image_size):
        mean = expected.mean.copy()
        mean[0] = np.log(focal)
        camera = camera_of(mean, image_size)
        poses = _poses(camera, few)
        guesses.append(camera)
        errors.append(np.inf if poses is None else _rms(camera, poses, few))
    return guesses[int(np.argmin(errors))]


def _poses(camera: Camera, views: Sequence[TargetView]) -> tuple[Pose, ...] | None:
    """The better pose of each view; None where a view has none."""
    found = []
    for view in views:
        hypotheses = planar_poses(camera, view.points_mm, view.pixels)
        if not hypotheses:
            return None
        found.append(hypotheses[0].pose)
    return tuple(found)


def _rms(camera: Camera, poses: Sequence[Pose], views: Sequence[TargetView]) -> float:
    errors = [camera.project(p, _in_space(v)) - v.pixels for p, v in zip(poses, views, strict=True)]
    return float(np.sqrt(np.mean(np.sum(np.concatenate(errors) ** 2, axis=1))))


def _in_space(view: TargetView) -> Array:
    return np.column_stack([view.points_mm, np.zeros(len(view.points_mm))])


@dataclass(slots=True)
class _Normal:
    """Normal equations with the poses apart."""

    matrix: Array
    right: Array
    pose_matrix: list[Array]
    pose_cross: list[Array]
    pose_right: list[Array]

    def reduced(self, damping: float) -> tuple[Array, Array, list[Array]]:
        """The intrinsics' own equations, and what turns their step into the poses'."""
        matrix, right = self.matrix.copy(), self.right.copy()
        gains: list[Array] = []
        for c, b, r in zip(self.pose_matrix, self.pose_cross, self.pose_right, strict=True):
            damped = c + damping * np.diag(np.diag(c))
            gain = np.asarray(np.linalg.solve(damped, np.column_stack([b.T, r])), float)
            matrix -= b @ gain[:, :-1]
            right -= b @ gain[:, -1]
            gains.append(gain)
        return matrix, right, gains


def _adjust(camera: Camera, poses: Sequence[Pose], views: Sequence[TargetView], expected: Expectation) -> CameraFit:
    """Levenberg and Marquardt from a start; robust from its second step."""
    size, free = camera.image_size, expected.stddev > 0.0
    x = np.where(free, _parameters(camera), expected.mean)
    at = np.array([np.concatenate([pose.rvec, pose.translation]) for pose in poses])
    residuals, stddev = _residuals(x, at, views, size), 0.0
    damping, cost = 1e-4, np.inf
    for _ in range(_STEPS):
        stddev = _robust_stddev(residuals, len(at) * 6 + int(np.count_nonzero(free)))
        normal = _normal(x, at, views, size, residuals, stddev, expected)
        cost = _cost(residuals, stddev, x, expected)
        improvement = 0.0
        while damping < 1e6:
            matrix, right, gains = normal.reduced(damping)
            matrix = matrix[np.ix_(free, free)]
            step = np.zeros(len(x))
            step[free] = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), right[free])
            moved = at + np.array([gain[:, -1] - gain[:, :-1] @ step for gain in gains])
            tried = _residuals(x + step, moved, views, size)
            improvement = cost - _cost(tried, stddev, x + step, expected)
            if improvement >= 0.0:
                x, at, residuals, damping = x + step, moved, tried, max(damping / 5.0, 1e-9)
                break
            damping *= 8.0
        if improvement < _LEAST_IMPROVEMENT * cost:
            break
    normal = _normal(x, at, views, size, residuals, stddev, expected)
    information = normal.reduced(0.0)[0][np.ix_(free, free)]
    covariance = np.zeros((len(x), len(x)))
    covariance[np.ix_(free, free)] = np.linalg.pinv(information, hermitian=True)
    found = tuple(Pose.from_rvec(p[:3], p[3:]) for p in at)
    return CameraFit(camera_of(x, size), covariance, found, residuals, stddev)


def _residuals(x: Array, at: Array, views: Sequence[TargetView], size: tuple[int, int]) -> tuple[Array, ...]:
    camera = camera_of(x, size)
    return tuple(
        view.pixels - camera.project(Pose.from_rvec(p[:3], p[3:]), _in_space(view))
        for view, p in zip(views, at, strict=True)
    )


def _normal(
    x: Array, at: Array, views: Sequence[TargetView], size: tuple[int, int], residuals: Sequence[Array],
    stddev: float, expected: Expectation,
) -> _Normal:  # fmt: skip
    camera = camera_of(x, size)
    held = expected.stddev == 0.0
    precision = np.where(held, 0.0, 1.0 / np.where(held, 1.0, expected.stddev) ** 2)
    normal = _Normal(np.diag(precision), precision * (expected.mean - x), [], [], [])
    for view, p, residual in zip(views, at, residuals, strict=True):
        _, j = cv2.projectPoints(_in_space(view), p[:3], p[3:], camera.camera_matrix, camera.distortion)
        inner, pose = _by_parameter(j, camera), j[:, :6]
        weight = np.repeat(_weights(residual, stddev), 2)[:, None] / stddev**2
        flat = residual.reshape(-1)
        normal.matrix += inner.T @ (weight * inner)
        normal.right += inner.T @ (weight[:, 0] * flat)
        normal.pose_matrix.append(pose.T @ (weight * pose))
        normal.pose_cross.append(inner.T @ (weight * pose))
        normal.pose_right.append(pose.T @ (weight[:, 0] * flat))
    return normal


def _by_parameter(jacobian: Any, camera: Camera) -> Array:
    """OpenCV's derivatives by (fx, fy, cx, cy, lens) as derivatives by `NAMES`."""
    fx, fy = camera.camera_matrix[0, 0], camera.camera_matrix[1, 1]
    across, down = jacobian[:, 6] * fx, jacobian[:, 7] * fy
    return np.column_stack([across + down, across, jacobian[:, 8:15]])


def _weights(residual: Array, stddev: float) -> Array:
    """(n,) Cauchy weights: half at 3.5 standard deviations."""
    return 1.0 / (1.0 + np.sum(residual**2, axis=1) / (2.0 * (2.5 * stddev) ** 2))


def _cost(residuals: Sequence[Array], stddev: float, x: Array, expected: Expectation) -> float:
    squared = np.concatenate([np.sum(r**2, axis=1) for r in residuals])
    bound = 2.0 * (2.5 * stddev) ** 2
    known = expected.stddev > 0.0
    prior = float(np.sum(((x - expected.mean)[known] / expected.stddev[known]) ** 2))
    return float(np.sum(bound * np.log1p(squared / bound))) / stddev**2 + prior


def _robust_stddev(residuals: Sequence[Array], unknowns: int) -> float:
    """From the median length of the errors, for the degrees of freedom that fitting leaves."""
    squared = np.concatenate([np.sum(r**2, axis=1) for r in residuals])
    left = max(2.0 * len(squared) - unknowns, 1.0) / (2.0 * len(squared))
    return max(float(np.sqrt(np.median(squared) / (2.0 * np.log(2.0)) / left)), _SMALLEST_STDDEV_PX)
