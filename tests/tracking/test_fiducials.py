import dataclasses

import cv2
import numpy as np
import pytest

from arlight.errors import ProbeError
from arlight.probe.design import Marker
from arlight.tracking.fiducials import FiducialDetector


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_corners_at_every_resolution(sheet, camera, look, photograph, scale) -> None:
    pose = look(25, 70, 260, 20)
    found = FiducialDetector(sheet).detect(photograph(camera, pose), scale)
    assert {detection.marker_id for detection in found} == {marker.id for marker in sheet.markers}
    corners = {marker.id: np.column_stack([marker.corners_mm, np.zeros(4)]) for marker in sheet.markers}
    error = [d.corners_px - camera.project(pose, corners[d.marker_id]) for d in found]
    # Blur in encoded light pulls corners inward by about a pixel of the resolution searched, without a common shift.
    assert np.sqrt(np.mean(np.sum(np.square(error), axis=-1))) < 1.0 / min(scale, 1.0)
    assert np.max(np.abs(np.mean(error, axis=(0, 1)))) < 0.15


def test_ids_are_those_of_the_sheet(sheet) -> None:
    own = dataclasses.replace(sheet, markers=tuple(Marker(k, sheet.markers[0].corners_mm) for k in (17, 3)))
    image = np.full((300, 500), 255, np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for place, number in enumerate((3, 17, 5)):
        image[100:190, 50 + 150 * place : 140 + 150 * place] = dictionary.generateImageMarker(number, 90)
    found = {d.marker_id: d.corners_px.mean(axis=0) for d in FiducialDetector(own).detect(image)}
    assert set(found) == {3, 17}
    np.testing.assert_allclose(found[3], [94.5, 144.5], atol=0.2)
    np.testing.assert_allclose(found[17], [244.5, 144.5], atol=0.2)


@pytest.mark.parametrize("size", [(1, 1), (5, 40), (48, 64), (200, 300)])
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_nothing_in_an_empty_picture(sheet, size, scale) -> None:
    assert FiducialDetector(sheet).detect(np.zeros(size, np.uint8), scale) == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dictionary": "DICT_9X9_1"}, "DICT_4X4_50.*DICT_9X9_1"),
        ({"dictionary": "ArucoDetector"}, "must be one of"),
        ({"markers": ()}, "at least one marker"),
        ({"markers": (Marker(50, ((0, 0),) * 4),)}, "0 to 49.*50"),
        ({"markers": (Marker(-1, ((0, 0),) * 4),)}, "0 to 49.*-1"),
        ({"markers": (Marker(4, ((0, 0),) * 4), Marker(4, ((1, 1),) * 4))}, "id of its own"),
    ],
)
def test_sheets_that_cannot_be_found_are_refused(sheet, change, message) -> None:
    with pytest.raises(ProbeError, match=message):
        FiducialDetector(dataclasses.replace(sheet, **change))
