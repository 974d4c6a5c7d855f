"""What users would otherwise use, run as they would run it: detection of every frame, and drawing of the whole one."""

from collections.abc import Sequence
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.tracking.fiducials import aruco_dictionary

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

# pupil-apriltags names the corners the other way round, beginning with the marker's second
_APRILTAG_CORNERS = [1, 0, 3, 2]


class PoseYardstick(Protocol):
    """Another way to the sheet's pose in one frame."""

    name: str
    """What it is, in words."""

    def pose(self, luma: Image) -> Pose | None:
        """camera_from_probe of a picture (h, w); None where the sheet is not found."""


class ArucoPose:
    """OpenCV's ArUco detection of the whole frame, default settings and sub-pixel corners, and solvePnP."""

    name = "ArUco + solvePnP"

    def __init__(self, probe: Probe, camera: Camera) -> None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(aruco_dictionary(probe.dictionary), parameters)
        self._solver = _CornerPose(probe, camera)

    def pose(self, luma: Image) -> Pose | None:
        corners, ids, _ = self._detector.detectMarkers(luma)
        return None if ids is None else self._solver.pose([int(i) for i in np.ravel(ids)], [c[0] for c in corners])


class AprilTagPose:
    """pupil-apriltags with its default settings on the whole frame, one thread, and solvePnP.

    Raises:
        ImportError: the optional package is not installed.
    """

    name = "pupil-apriltags + solvePnP"

    def __init__(self, probe: Probe, camera: Camera) -> None:
        from pupil_apriltags import Detector

        self._detector = Detector(families="tag36h11", nthreads=1)
        self._solver = _CornerPose(probe, camera)

    def pose(self, luma: Image) -> Pose | None:
        found = self._detector.detect(np.ascontiguousarray(luma))
        return self._solver.pose([tag.tag_id for tag in found], [tag.corners[_APRILTAG_CORNERS] for tag in found])


class _CornerPose:
    """solvePnP from all corners of the markers that were seen."""

    def __init__(self, probe: Probe, camera: Camera) -> None:
        self._corners_mm = {m.id: np.array([[x, y, 0.0] for x, y in m.corners_mm]) for m in probe.markers}
        self._camera = camera

    def pose(self, ids: Sequence[int], corners_px: Sequence[Any]) -> Pose | None:
        """Of markers by number and their corners (4, 2) in the picture; None where none is the sheet's."""
        own = [
            (self._corners_mm[i], corners) for i, corners in zip(ids, corners_px, strict=True) if i in self._corners_mm
        ]
        if not own:
            return None
        points = np.concatenate([points for points, _ in own])
        pixels = np.concatenate([np.asarray(corners, float) for _, corners in own])
        done, rvec, tvec = cv2.solvePnP(points, pixels, self._camera.camera_matrix, self._camera.distortion)
        return Pose.from_rvec(rvec.ravel(), tvec.ravel()) if done else None
