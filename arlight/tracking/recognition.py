"""Which fiducials are in a picture at all, of any dictionary: what to tell a user whose probe was never found."""

from collections import Counter
from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.probe.design import Probe

# the largest of each family holds its smaller ones; dictionaries of 4x4 bits and fewer see markers in noise, so a
# marker counts once it was seen in two pictures
_FAMILIES = (
    "DICT_4X4_1000",
    "DICT_5X5_1000",
    "DICT_6X6_1000",
    "DICT_7X7_1000",
    "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_36h11",
)
_SEEN_OFTEN = 2


def recognise_markers(pictures: Iterable[NDArray[np.uint8]]) -> dict[str, list[int]]:
    """Markers that occur in several pictures.

    Args:
        pictures: (h, w) encoded luma; of a single one every marker counts.

    Returns:
        Ids, sorted, by the name of their dictionary; dictionaries without a marker are left out.
    """
    counts: dict[str, Counter[int]] = {name: Counter() for name in _FAMILIES}
    pictures_seen = 0
    for picture in pictures:
        pictures_seen += 1
        for name, counter in counts.items():
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
            _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(picture)
            counter.update(set() if ids is None else {int(index) for index in np.ravel(ids)})
    often = min(_SEEN_OFTEN, pictures_seen)
    found = {name: sorted(i for i, n in counter.items() if n >= often) for name, counter in counts.items()}
    return {name: ids for name, ids in found.items() if ids}


def same_family(dictionary: str, other: str) -> bool:
    """Whether the markers of one dictionary are markers of the other, as those of DICT_4X4_50 are of DICT_4X4_1000."""
    return _family(dictionary) == _family(other)


def markers_of(probe: Probe) -> str:
    """The probe's fiducials in words."""
    return f"{probe.dictionary} {ids_text([marker.id for marker in probe.markers])}"


def ids_text(ids: Iterable[int]) -> str:
    """Ids in words, runs shortened: 0-3, 7."""
    runs: list[list[int]] = []
    for index in sorted(ids):
        if runs and index == runs[-1][-1] + 1:
            runs[-1].append(index)
        else:
            runs.append([index])
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)


def _family(dictionary: str) -> str:
    stem, _, count = dictionary.rpartition("_")
    return stem if count.isdigit() else dictionary
