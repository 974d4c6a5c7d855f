"""What the fiducials look like: their modules, and the points near module edges that alignment compares."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.probe.design import Probe
from arlight.tracking.fiducials import aruco_dictionary, check_marker_ids

Array = NDArray[np.float64]

OFFSETS = (-1.8, -0.6, 0.6, 1.8)
"""Where points lie across an edge, in standard deviations of the blur: symmetric, so a wrong blur does not shift."""
ALONG = (0.25, 0.75)
"""Where points lie along an edge, in modules."""
MAX_EDGES = 50
"""Module edges of a marker that carry points; codes with more are thinned."""


@dataclass(frozen=True, slots=True)
class FiducialTemplate:
    """The markers of a sheet in module coordinates: u to the right, v down, 0 at the marker's top left corner."""

    places: Array
    """(m, 6) top left corner, one module to the right, one module down, x and y each, in the probe frame [mm]."""
    black: Array
    """(m, n, n) 1 where a module (row, column) is black, border included."""
    position_base: Array
    """(k,) coordinates that points can take on either axis, without blur [modules]."""
    position_spread: Array
    """(k,) what the blur adds to them [standard deviations of the blur]."""
    index_u: NDArray[np.int64]
    """(m, p) which coordinate is a point's u. The first half of the points covers every edge once."""
    index_v: NDArray[np.int64]
    """(m, p) which coordinate is a point's v."""

    @property
    def size(self) -> int:
        """Modules on a marker's side, border included."""
        return self.black.shape[1]

    @classmethod
    def of_probe(cls, probe: Probe) -> "FiducialTemplate":
        """The fiducials of a sheet.

        Raises:
            ProbeError: the dictionary is unknown, or has no marker of a wanted id.
        """
        dictionary = aruco_dictionary(probe.dictionary)
        check_marker_ids(probe, dictionary)
        size = int(dictionary.markerSize) + 2
        corners = np.array([marker.corners_mm for marker in probe.markers], float)
        black = np.array(
            [dictionary.generateImageMarker(marker.id, size, borderBits=1) == 0 for marker in probe.markers], float
        )
        edges = [_edges(modules) for modules in black]
        # As many for every marker, spread over all of its edges.
        number = min(MAX_EDGES, *(len(entry) for entry in edges))
        chosen = [[entry[k * len(entry) // number] for k in range(number)] for entry in edges]
        points = np.array([_points(entry, size) for entry in chosen], np.int64)
        base, spread = _positions(size)
        return cls(
            places=np.concatenate(
                [corners[:, 0], (corners[:, 1] - corners[:, 0]) / size, (corners[:, 3] - corners[:, 0]) / size], axis=1
            ),
            black=black,
            position_base=base,
            position_spread=spread,
            index_u=np.ascontiguousarray(points[..., 0]),
            index_v=np.ascontiguousarray(points[..., 1]),
        )


def _positions(size: int) -> tuple[Array, Array]:
    """Coordinates on an axis: beside each of size + 1 grid lines, then along each of size modules."""
    lines = np.repeat(np.arange(size + 1, dtype=float), len(OFFSETS))
    along = np.add.outer(np.arange(size, dtype=float), ALONG).reshape(-1)
    spread = np.concatenate([np.tile(OFFSETS, size + 1), np.zeros(len(along))])
    return np.concatenate([lines, along]), spread


def _edges(black: Array) -> list[tuple[int, int, bool]]:
    """Grid line, module along it, and whether it runs along u, of every edge between a black and a white module."""
    size = len(black)
    padded = np.pad(black, 1)
    edges = []
    for line in range(size + 1):
        for module in range(size):
            if padded[module + 1, line] != padded[module + 1, line + 1]:
                edges.append((line, module, False))
            if padded[line, module + 1] != padded[line + 1, module + 1]:
                edges.append((line, module, True))
    return edges


def _points(edges: list[tuple[int, int, bool]], size: int) -> list[tuple[int, int]]:
    """Indices (u, v) into the positions of the points on some edges."""
    first_along = (size + 1) * len(OFFSETS)
    points = []
    for k in range(len(ALONG)):
        for number, (line, module, along_u) in enumerate(edges):
            # Neighbouring edges start at opposite ends, so that half of the points are still balanced.
            along = first_along + module * len(ALONG) + (k + number) % len(ALONG)
            across = [line * len(OFFSETS) + offset for offset in range(len(OFFSETS))]
            points += [(along, a) if along_u else (a, along) for a in across]
    return points
