"""Finding the sheet's ArUco fiducials in a frame, without knowing where they are."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.errors import ProbeError
from arlight.probe.design import Probe

Array = NDArray[np.float64]

# Detection works on encoded luma, where blur draws the outline of a dark square inward; the contour runs through the
# centres of the outermost dark pixels, half a pixel inside the edge. Alignment removes what is left.
_SHORTEST_PERIMETER_PX = 24.0


@dataclass(frozen=True, slots=True)
class Detection:
    """One fiducial seen in a frame."""

    marker_id: int
    """Its number in the sheet's dictionary."""
    corners_px: Array
    """(4, 2) corners in ArUco's order [px, centres at integers]."""


class FiducialDetector:
    """ArUco detection with the dictionary cut to the sheet's own markers.

    Args:
        probe: the sheet; its dictionary must be one of OpenCV's and hold its markers' ids.

    Raises:
        ProbeError: the dictionary is unknown, or has no marker of a wanted id.
    """

    def __init__(self, probe: Probe) -> None:
        dictionary = aruco_dictionary(probe.dictionary)
        self._ids = [marker.id for marker in probe.markers]
        check_marker_ids(probe, dictionary)
        # A dictionary with unused codes costs several times more and invites false detections.
        own = cv2.aruco.Dictionary(
            np.ascontiguousarray(dictionary.bytesList[self._ids]), dictionary.markerSize, dictionary.maxCorrectionBits
        )
        self._own = own

    def detect(self, luma: NDArray[np.uint8], scale: float = 1.0) -> list[Detection]:
        """Fiducials in a picture.

        Args:
            luma: (h, w) encoded luma.
            scale: the picture is resampled by this factor first: below 1 is faster, above 1 finds smaller markers.

        Returns:
            One entry a marker seen; an id can occur more than once.
        """
        if min(luma.shape) * scale < 16:
            return []
        image = luma
        if scale != 1.0:
            kind = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
            image = np.asarray(cv2.resize(luma, None, fx=scale, fy=scale, interpolation=kind), np.uint8)
        longest = float(max(image.shape))
        parameters = cv2.aruco.DetectorParameters()
        parameters.minMarkerPerimeterRate = min(_SHORTEST_PERIMETER_PX / longest, 0.03)
        # Settings below differ from OpenCV's for foreshortened markers a few pixels high and for weak contrast.
        parameters.polygonalApproxAccuracyRate = 0.05
        parameters.minCornerDistanceRate = 0.01
        parameters.minMarkerDistanceRate = 0.02
        parameters.minDistanceToBorder = 1
        parameters.perspectiveRemovePixelPerCell = 8
        parameters.adaptiveThreshConstant = 4.0
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        found, indices, _ = cv2.aruco.ArucoDetector(self._own, parameters).detectMarkers(image)
        if indices is None:
            return []
        return [
            Detection(self._ids[int(index)], (np.asarray(corners, float).reshape(4, 2) + 0.5) / scale - 0.5)
            for index, corners in zip(np.ravel(indices), found, strict=True)
        ]


def aruco_dictionary(name: str) -> Any:
    """One of OpenCV's predefined dictionaries by name, such as DICT_4X4_50.

    Raises:
        ProbeError: there is no such dictionary.
    """
    code = getattr(cv2.aruco, name, None) if name.startswith("DICT_") else None
    if code is None:
        names = ", ".join(sorted(entry for entry in dir(cv2.aruco) if entry.startswith("DICT_")))
        raise ProbeError(f"the fiducials' dictionary must be one of {names}; found {name!r}")
    return cv2.aruco.getPredefinedDictionary(code)


def check_marker_ids(probe: Probe, dictionary: Any) -> None:
    """Refuse a sheet whose markers cannot be told apart, or are not in the dictionary."""
    ids = [marker.id for marker in probe.markers]
    size = len(dictionary.bytesList)
    if not ids:
        raise ProbeError("the probe has no fiducials; tracking needs at least one marker")
    if min(ids) < 0 or max(ids) >= size:
        raise ProbeError(f"marker ids must lie in 0 to {size - 1} for {probe.dictionary}; found {sorted(ids)}")
    if len(set(ids)) != len(ids):
        raise ProbeError(f"every marker of the sheet needs an id of its own; found {sorted(ids)}")
