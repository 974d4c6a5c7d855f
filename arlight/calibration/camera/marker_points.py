"""Where each fiducial of the sheet is in a picture, by aligning it to the picture by itself.

ArUco's corners are drawn inward by blur; their diagonals' crossing is not, and serves to begin with. What alignment
then finds is free of blur, of the markers' lighting and, to first order, of errors of the intrinsics it starts from.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.camera_fit import TargetView
from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.tracking.alignment_kernels import LIGHT, LIGHTING, AlignmentKernels, Picture
from arlight.tracking.fiducials import Detection, FiducialDetector

Array = NDArray[np.float64]

FEWEST_MARKERS = 4
_TYPICAL_BLUR_PX = 0.9
_SCALES = (1.0, 2.0, 0.5)
"""Resolutions to search at, in turn, until the markers suffice."""
_ENOUGH = 0.75
"""Share of the sheet's markers that ends the search for more."""
_CORRELATION = 0.9
"""Correlation below which a marker is hidden or torn."""
_STEPS = 4
_FARTHEST_PX = 6.0
"""No marker is that far from where a camera that explains the others puts it."""
_ACROSS, _DOWN = LIGHTING + 3, LIGHTING + 4
"""Features: derivatives by translation in the camera's x and y."""


class MarkerPoints:
    """Finds the centres of a sheet's markers in pictures.

    Args:
        probe: the sheet.

    Raises:
        ProbeError: the sheet has no fiducials that ArUco knows.
    """

    def __init__(self, probe: Probe) -> None:
        self._probe = probe
        self._detector = FiducialDetector(probe)
        corners = np.array([marker.corners_mm for marker in probe.markers], float)
        self._centres = corners.mean(axis=1)
        self._row = {marker.id: row for row, marker in enumerate(probe.markers)}

    def detect(self, luma: NDArray[np.uint8], name: str) -> TargetView | None:
        """Centres from ArUco's corners, a few tenths of a pixel off; None where fewer than four markers are seen.

        Args:
            luma: (h, w) luma codes.
            name: of the picture.
        """
        best: list[Detection] = []
        for scale in _SCALES:
            found = self._detector.detect(luma, scale)
            ids = [detection.marker_id for detection in found]
            # a marker that is in the picture twice: neither can be told to be the sheet's
            single = [detection for detection in found if ids.count(detection.marker_id) == 1]
            best = max(best, single, key=len)
            if len(best) >= _ENOUGH * len(self._centres):
                break
        if len(best) < FEWEST_MARKERS:
            return None
        rows = [self._row[detection.marker_id] for detection in best]
        pixels = np.array([_crossing(detection.corners_px) for detection in best])
        return TargetView(name, self._centres[rows], pixels)

    def align(
        self, luma: NDArray[np.uint8], table: NDArray[np.float32], camera: Camera, pose: Pose, name: str
    ) -> TargetView | None:
        """Centres by alignment in linear light; None where fewer than four markers can be aligned.

        Args:
            luma: (h, w) luma codes as in the stream, of the camera's image size.
            table: (256,) linear light of each code.
            camera: intrinsics, roughly.
            pose: camera_from_probe to within a few pixels.
            name: of the picture.
        """
        kernels = AlignmentKernels(self._probe, camera)
        kernels.show(Picture(luma, table))
        blur = _TYPICAL_BLUR_PX
        for coarsest in (2, 1, 1):
            if not kernels.align(pose, blur, coarsest):
                return None
            pose, blur = kernels.aligned, float(kernels.result[2])
        return self._each(kernels, camera, pose, blur, name)

    def _each(
        self, kernels: AlignmentKernels, camera: Camera, pose: Pose, blur_px: float, name: str
    ) -> TargetView | None:
        """Move every marker by itself on the sheet until it fits."""
        shift, corners = np.zeros_like(self._centres), kernels.places[:, :2].copy()
        kernels.draw(pose, blur_px)
        kernels.coefficients[:] = 0.0
        for _ in range(_STEPS):
            kernels.places[:, :2] = corners + shift
            kernels.observe(pose, 0.0)
            seen = kernels.weight > 0.0
            shift[seen] += _steps(
                kernels.gram[seen], kernels.coefficients[seen, 0], self._centres[seen] + shift[seen], pose
            )
        pixels = _project(camera, pose, self._centres + shift)
        moved = np.linalg.norm(pixels - _project(camera, pose, self._centres), axis=1)
        good = seen & (kernels.correlation > _CORRELATION) & (moved < _FARTHEST_PX)
        if np.count_nonzero(good) < FEWEST_MARKERS:
            return None
        return TargetView(name, self._centres[good], pixels[good])


def _steps(gram: Array, gain: Array, at_mm: Array, pose: Pose) -> Array:
    """(m, 2) steps on the sheet that the markers' own equations ask for [mm]."""
    matrix, right = gram[:, _ACROSS : _DOWN + 1, _ACROSS : _DOWN + 1], gram[:, _ACROSS : _DOWN + 1, LIGHT:]
    matrix, right = np.triu(matrix) + np.triu(matrix, 1).transpose(0, 2, 1), right / gain[:, None, None]
    sound = matrix + 1e-9 * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    across = -np.asarray(np.linalg.solve(sound, right), float)
    seen = pose.transform(np.column_stack([at_mm, np.zeros(len(at_mm))]))
    sight = seen[:, :2, None] / seen[:, 2:, None]
    on_sheet = pose.rotation[:2, :2] - sight * pose.rotation[2, :2]
    step: Array = np.linalg.solve(on_sheet, across)[..., 0]
    return step


def _project(camera: Camera, pose: Pose, points_mm: Array) -> Array:
    return camera.project(pose, np.column_stack([points_mm, np.zeros(len(points_mm))]))


def _crossing(corners_px: Array) -> Array:
    """Where the diagonals of a quadrilateral cross: the centre of a square in perspective."""
    a, b, c, d = corners_px
    share = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    crossing: Array = a + share[0] * (c - a)
    return crossing
