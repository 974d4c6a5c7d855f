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
        Up to two hypotheses with the camera above the sheet; none where the points are degenerate.

    Source: Collins and Bartoli, Infinitesimal plane-based pose estimation, 2014.
    """
    points = np.column_stack([points_mm, np.zeros(len(points_mm))])
    rays = np.ascontiguousarray(camera.rays(pixels))
    if len(points) < 4 or not np.all(np.isfinite(rays)):
        return []
    try:
        # On undistorted rays: solvePnP's own undistortion stops after five rounds, too early for a strong lens.
        solved = cv2.solvePnPGeneric(points, rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return []
    hypotheses = []
    for rvec, translation in zip(solved[1], solved[2], strict=True):
        if not (np.all(np.isfinite(rvec)) and np.all(np.isfinite(translation))):
            continue
        start_t = np.array(translation, float)
        start_r = np.array(rvec, float)
        rvec, translation = cv2.solvePnPRefineLM(
            points, pixels, camera.camera_matrix, camera.distortion, start_r, start_t
        )
        pose = Pose.from_rvec(rvec, translation)
        if is_seen_from_above(pose, points):
            error = camera.project(pose, points) - pixels
            hypotheses.append(PoseHypothesis(pose, float(np.sqrt(np.mean(np.sum(error**2, axis=1)))), markers))
    return sorted(hypotheses, key=lambda hypothesis: hypothesis.rms_px)


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
