"""Where each fiducial of the sheet is in a picture, by aligning it to the picture by itself.

ArUco's corners are drawn inward by blur; their diagonals' crossing is not, and serves to begin with. What alignment
then finds is free of blur, of the markers' lighting and, to first order, of errors of the intrinsics it starts from.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.camera_fit import TargetView
from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.tracking.alignment import FiducialAlignment, Picture
from arlight.tracking.alignment_kernels import FEATURES, LIGHTING, POSE, linearise
from arlight.tracking.fiducials import Detection, FiducialDetector
from arlight.tracking.lens import camera_parameters
from arlight.tracking.template import FiducialTemplate
from arlight.tracking.template_kernels import render

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
_OUTLIER_LIMIT = 0.25


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
        self._template = FiducialTemplate.of_probe(probe)
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
            luma: (h, w) luma codes as in the stream.
            table: (256,) linear light of each code.
            camera: intrinsics, roughly.
            pose: camera_from_probe to within a few pixels.
            name: of the picture.
        """
        alignment = FiducialAlignment(self._probe, camera)
        region = alignment.region(pose)
        if region is None:
            return None
        x0, y0, x1, y1 = region
        picture = Picture(np.array(luma[y0:y1, x0:x1], order="C"), np.array(table, np.float32), (x0, y0))
        blur = _TYPICAL_BLUR_PX
        for coarsest in (2, 1, 1):
            found = alignment.align(picture, pose, blur, coarsest)
            if found is None:
                return None
            pose, blur = found.pose, found.blur_px
        return self._each(picture, camera, pose, blur, name)

    def _each(self, picture: Picture, camera: Camera, pose: Pose, blur_px: float, name: str) -> TargetView | None:
        """Move every marker by itself on the sheet until it fits."""
        shift = np.zeros_like(self._centres)
        codes, table, window = picture.level(1)
        parameters = camera_parameters(camera)
        at = np.concatenate([np.ravel(pose.rotation), pose.translation])
        points, values = self._draw(camera, pose, blur_px)
        m, _, p = points.shape
        coefficients, gram = np.zeros((m, LIGHTING)), np.zeros((m, FEATURES, FEATURES))
        features, scratch = np.zeros((m, FEATURES, p)), np.zeros((2, p))
        correlation, weight, normal = np.zeros(m), np.zeros(m), np.zeros((POSE + 1, POSE + 1))
        for _ in range(_STEPS):
            places = self._template.places.copy()
            places[:, :2] += shift
            linearise(
                codes, table, window, parameters, at, places, self._template.size, points, values, 0.0,
                _OUTLIER_LIMIT, coefficients, features, scratch, gram, correlation, weight, normal,
            )  # fmt: skip
            seen = weight > 0.0
            shift[seen] += _steps(gram[seen], coefficients[seen, 0], self._centres[seen] + shift[seen], pose)
        pixels = _project(camera, pose, self._centres + shift)
        moved = np.linalg.norm(pixels - _project(camera, pose, self._centres), axis=1)
        good = seen & (correlation > _CORRELATION) & (moved < _FARTHEST_PX)
        if np.count_nonzero(good) < FEWEST_MARKERS:
            return None
        return TargetView(name, self._centres[good], pixels[good])

    def _draw(self, camera: Camera, pose: Pose, blur_px: float) -> tuple[Array, Array]:
        """The template's points and its values there, blurred on each marker's axes as isotropic blur does there."""
        t = self._template
        ends = np.stack([self._centres, self._centres + t.places[:, 2:4], self._centres + t.places[:, 4:6]], axis=1)
        pixels = _project(camera, pose, ends.reshape(-1, 2)).reshape(-1, 3, 2)
        along_u, along_v = pixels[:, 1] - pixels[:, 0], pixels[:, 2] - pixels[:, 0]
        area = np.maximum(np.abs(along_u[:, 0] * along_v[:, 1] - along_u[:, 1] * along_v[:, 0]), 1e-9)
        modules_per_px = np.stack([np.hypot(*along_v.T), np.hypot(*along_u.T)], axis=1) / area[:, None]
        m, p = t.index_u.shape
        points, values = np.zeros((m, 2, p)), np.zeros((m, 3, p))
        render(
            t.black, t.position_base, t.position_spread, t.index_u, t.index_v, blur_px * modules_per_px,
            max(blur_px, _TYPICAL_BLUR_PX) * modules_per_px, points, values,
        )  # fmt: skip
        return points, values


def _steps(gram: Array, gain: Array, at_mm: Array, pose: Pose) -> Array:
    """(m, 2) steps on the sheet that the markers' own equations ask for [mm]."""
    matrix, right = gram[:, 7:9, 7:9], gram[:, 7:9, 10:] / gain[:, None, None]
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
