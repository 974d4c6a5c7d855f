"""Pose of the flat sheet from corresponding points: both of the plane's hypotheses, and which markers to believe."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.tracking.fiducials import Detection

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PoseHypothesis:
    """One of the two poses that explain a plane's picture."""

    pose: Pose
    """camera_from_probe."""
    rms_px: float
    """Rms reprojection error of the points that it was fitted to [px]."""
    markers: int
    """Number of markers that it was fitted to."""


def planar_poses(camera: Camera, points_mm: Array, pixels: Array, markers: int = 1) -> list[PoseHypothesis]:
    """Both planar pose hypotheses (IPPE), refined on all points, the better one first.

    Args:
        camera: with its lens distortion.
        points_mm: (n, 2) points of the plane z = 0, n >= 4, probe frame [mm].
        pixels: (n, 2) where they are seen [px].
        markers: how many markers they belong to.

    Returns:
        Up to two hypotheses with the camera above the sheet, one where refinement leads both to the same; none where
        the points are degenerate.

    Source: Collins and Bartoli, Infinitesimal plane-based pose estimation, 2014.
    """
    points = np.column_stack([points_mm, np.zeros(len(points_mm))])
    if len(points) < 4:
        return []
    hypotheses: list[PoseHypothesis] = []
    for start in _poses_of_homography(np.asarray(points_mm, float), camera.rays(pixels)):
        # Columns: given flat vectors, OpenCV 5.0 returns them unrefined.
        rvec, translation = cv2.solvePnPRefineLM(
            points, pixels, camera.camera_matrix, camera.distortion, start.rvec[:, None], start.translation[:, None]
        )
        pose = Pose.from_rvec(rvec, translation)
        if is_seen_from_above(pose, points) and not any(_same(pose, other.pose) for other in hypotheses):
            error = camera.project(pose, points) - pixels
            hypotheses.append(PoseHypothesis(pose, float(np.sqrt(np.mean(np.sum(error**2, axis=1)))), markers))
    return sorted(hypotheses, key=lambda hypothesis: hypothesis.rms_px)


def _poses_of_homography(points_mm: Array, rays: Array) -> list[Pose]:
    """Both poses that agree with the plane's homography to first order at the points' middle.

    Written out, because SOLVEPNP_IPPE of OpenCV 5.0 returns rotations that are far off.
    """
    middle = points_mm.mean(axis=0)
    scale = float(np.max(np.abs(points_mm - middle)))
    if scale == 0.0 or not np.all(np.isfinite(rays)):
        return []
    homography, _ = cv2.findHomography((points_mm - middle) / scale, rays)
    if homography is None or abs(homography[2, 2]) < 1e-12 or not np.all(np.isfinite(homography)):
        return []
    h = homography / homography[2, 2]
    sight = h[:2, 2]
    toward = _turn_z_to(np.append(sight, 1.0))
    slope = (h[:2, :2] - np.outer(sight, h[2, :2])) / scale
    projected = toward[:2, :2] - np.outer(sight, toward[2, :2])
    flat = np.linalg.solve(projected, slope)
    largest = float(np.linalg.norm(flat, 2))
    if largest < 1e-12:
        return []
    flat /= largest
    rest = np.eye(2) - flat.T @ flat
    third = np.sqrt(np.maximum(np.diag(rest), 0.0)) * np.array([1.0, 1.0 if rest[0, 1] >= 0.0 else -1.0])
    poses = []
    for row in (third, -third):
        first, second = np.append(flat[:, 0], row[0]), np.append(flat[:, 1], row[1])
        rotation = toward @ np.column_stack([first, second, np.cross(first, second)])
        turned = points_mm @ rotation[:, :2].T
        poses.append(Pose(rotation, _translation(turned, rays)))
    return poses


def _same(a: Pose, b: Pose) -> bool:
    """Whether two poses differ by less than refinement leaves."""
    return bool(np.allclose(a.rotation, b.rotation, atol=1e-3))


def _turn_z_to(direction: Array) -> Array:
    """The smallest rotation that takes the z axis to a direction in front of the camera."""
    x, y, z = direction / np.linalg.norm(direction)
    c = 1.0 / (1.0 + z)
    return np.array([[1.0 - c * x * x, -c * x * y, x], [-c * x * y, 1.0 - c * y * y, y], [-x, -y, z]])


def _translation(turned: Array, rays: Array) -> Array:
    """(3,) the translation that best puts points (n, 3), already turned, on their rays (n, 2); linear least squares."""
    n = len(turned)
    matrix = np.zeros((2 * n, 3))
    matrix[:n, 0] = matrix[n:, 1] = 1.0
    matrix[:n, 2], matrix[n:, 2] = -rays[:, 0], -rays[:, 1]
    right = np.concatenate([rays[:, k] * turned[:, 2] - turned[:, k] for k in range(2)])
    return np.linalg.lstsq(matrix, right, rcond=None)[0]


def is_seen_from_above(pose: Pose, points_mm: Array) -> bool:
    """Whether the camera looks at the printed side: it stands above z = 0, all points (n, 3) before it."""
    if not (np.all(np.isfinite(pose.rotation)) and np.all(np.isfinite(pose.translation))):
        return False
    return bool(pose.camera_centre_mm[2] > 0.0 and np.all(pose.transform(points_mm)[:, 2] > 0.0))


def poses_from_detections(camera: Camera, probe: Probe, detections: Sequence[Detection]) -> list[PoseHypothesis]:
    """Hypotheses for the pose of the sheet, the better one first, from the largest set of markers that agree.

    A second copy of a marker in view, or a false detection, does not fit the others' pose and is left out.
    """
    if not detections:
        return []
    distinct = len({detection.marker_id for detection in detections}) == len(detections)
    if distinct:
        everything = _fit(camera, probe, detections)
        if everything and len(_agreeing(camera, probe, detections, everything[0].pose)) == len(detections):
            return everything
    best: list[Detection] = []
    seeds: list[tuple[Detection, ...]] = [*combinations(detections, 2)] or [(detections[0],)]
    for seed in seeds:
        if len({detection.marker_id for detection in seed}) < len(seed):
            continue
        for hypothesis in _fit(camera, probe, seed):
            agreeing = _agreeing(camera, probe, detections, hypothesis.pose)
            if len(agreeing) > len(best):
                best = agreeing
    if not best:
        best = [max(detections, key=lambda detection: _side_px(detection.corners_px))]
    return _fit(camera, probe, best)


def _fit(camera: Camera, probe: Probe, detections: Sequence[Detection]) -> list[PoseHypothesis]:
    corners_mm = {marker.id: marker.corners_mm for marker in probe.markers}
    points = np.array([corners_mm[detection.marker_id] for detection in detections], float).reshape(-1, 2)
    pixels = np.concatenate([detection.corners_px for detection in detections])
    return planar_poses(camera, points, pixels, len(detections))


def _agreeing(camera: Camera, probe: Probe, detections: Sequence[Detection], pose: Pose) -> list[Detection]:
    """The detections that lie where the pose puts them, to within a fifth of their size; one for each id."""
    corners_mm = {marker.id: marker.corners_mm for marker in probe.markers}
    nearest: dict[int, tuple[float, Detection]] = {}
    for detection in detections:
        points = np.column_stack([corners_mm[detection.marker_id], np.zeros(4)])
        error = camera.project(pose, points) - detection.corners_px
        rms = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
        limit = 1.5 + 0.2 * _side_px(detection.corners_px)
        if rms < limit and rms < nearest.get(detection.marker_id, (np.inf, detection))[0]:
            nearest[detection.marker_id] = (rms, detection)
    return [detection for _, detection in nearest.values()]


def _side_px(corners_px: Array) -> float:
    """Mean side of a quadrilateral [px]."""
    return float(np.mean(np.linalg.norm(corners_px - np.roll(corners_px, 1, axis=0), axis=1)))
