"""Naming the markers of sheets that are not the user's."""

import cv2
import numpy as np
import pytest

from arlight.tracking.recognition import ids_text, recognise_markers, same_family


def picture(dictionary: str, ids: list[int]) -> np.ndarray:
    image = np.full((200, 100 + 120 * len(ids)), 230, np.uint8)
    markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    for place, index in enumerate(ids):
        left = 60 + 120 * place
        image[50:130, left : left + 80] = cv2.aruco.generateImageMarker(markers, index, 80)
    return image


@pytest.mark.parametrize(
    ("dictionary", "family"),
    [
        ("DICT_4X4_50", "DICT_4X4_1000"),
        ("DICT_5X5_100", "DICT_5X5_1000"),
        ("DICT_7X7_1000", "DICT_7X7_1000"),
        ("DICT_APRILTAG_36h11", "DICT_APRILTAG_36h11"),
    ],
)
def test_markers_of_any_dictionary_are_named(dictionary, family):
    image = picture(dictionary, [2, 17, 3])
    assert recognise_markers([image, image]) == {family: [2, 3, 17]}


def test_a_marker_must_be_seen_twice_unless_there_is_one_picture():
    once, never = picture("DICT_5X5_100", [4]), np.full((200, 200), 230, np.uint8)
    assert recognise_markers([once, never]) == {}
    assert recognise_markers([once]) == {"DICT_5X5_1000": [4]}
    assert recognise_markers([]) == {}


def test_families_hold_their_smaller_dictionaries():
    assert same_family("DICT_4X4_50", "DICT_4X4_1000")
    assert not same_family("DICT_4X4_50", "DICT_5X5_50")
    assert same_family("DICT_APRILTAG_36h11", "DICT_APRILTAG_36h11")
    assert not same_family("DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL")


@pytest.mark.parametrize(
    ("ids", "text"), [([], ""), ([3], "3"), ([0, 1, 2], "0-2"), ([7, 1, 0, 9, 8], "0-1, 7-9"), ([5, 3], "3, 5")]
)
def test_ids_in_words(ids, text):
    assert ids_text(ids) == text
