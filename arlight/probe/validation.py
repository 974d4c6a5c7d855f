"""What must hold between the fields of a probe: unique numbers, everything on the sheet, nothing on top of another."""

import numpy as np
from numpy.typing import NDArray

from arlight.probe.design import Probe
from arlight.probe.fields import Field

Array = NDArray[np.float64]

# blocks share edges whose coordinates were rounded when they were written
_SLACK_MM = 0.01

MOST_PIXELS_PER_SIDE = 20000
"""Larger rasters than this fit no memory."""


def check_geometry(probe: Probe, content: Field) -> None:
    """Refuse a probe whose parts contradict each other.

    Args:
        probe: what was read.
        content: where it was read from, to name the field.

    Raises:
        ProbeError: a number is used twice, a part lies outside the sheet, two parts overlap, a marker is not a
            clockwise square, or there is nothing to track or to measure.
    """
    markers, blocks = content.at("fiducials").at("markers"), content.at("blocks")
    if not probe.markers:
        raise markers.refuse("at least one marker to find the sheet by")
    if not any(block.kind == "pattern" for block in probe.blocks):
        raise blocks.refuse("at least one block of kind pattern", "none")
    pixels = [side * probe.pixels_per_mm for side in probe.sheet_mm]
    if min(pixels) < 1.0 or max(pixels) > MOST_PIXELS_PER_SIDE:
        raise content.at("pixels_per_mm").refuse(
            f"a resolution that gives the sheet of {probe.sheet_mm[0]:g} x {probe.sheet_mm[1]:g} mm 1 to "
            f"{MOST_PIXELS_PER_SIDE} pixels a side"
        )
    _check_unique([marker.id for marker in probe.markers], markers)
    _check_unique([block.id for block in probe.blocks], blocks)
    for marker, field in zip(probe.markers, markers.items(), strict=True):
        _check_marker(np.array(marker.corners_mm), field.at("corners_mm"))
    _check_boxes(probe, markers.items() + blocks.items())


def _check_unique(numbers: list[int], parts: Field) -> None:
    seen: dict[int, int] = {}
    for index, number in enumerate(numbers):
        if number in seen:
            raise (
                parts.items()[index]
                .at("id")
                .refuse("a number used once", f"{number}, which {parts.name}[{seen[number]}] has too")
            )
        seen[number] = index


def _check_marker(corners: Array, field: Field) -> None:
    """A marker is a square; clockwise as seen from above, or the camera would see it mirrored."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    square = np.ptp(lengths) <= 0.01 * lengths.max() and np.all(turns <= -0.99 * lengths.max() ** 2)
    if lengths.min() <= 0 or not square:
        raise field.refuse("the corners of a square, clockwise from the marker's top left with y up")


def _check_boxes(probe: Probe, fields: list[Field]) -> None:
    corners = [np.array(marker.corners_mm) for marker in probe.markers]
    low = [c.min(axis=0) for c in corners] + [np.array(b.center_mm) - b.size_mm / 2.0 for b in probe.blocks]
    high = [c.max(axis=0) for c in corners] + [np.array(b.center_mm) + b.size_mm / 2.0 for b in probe.blocks]
    lower, upper = np.array(low), np.array(high)
    half = np.array(probe.sheet_mm) / 2.0 + _SLACK_MM
    for outside in np.flatnonzero(np.any((lower < -half) | (upper > half), axis=1))[:1]:
        width, height = probe.sheet_mm
        raise fields[outside].refuse(
            f"a place on the sheet of {width:g} x {height:g} mm, whose centre is (0, 0)",
            f"x {lower[outside, 0]:g} to {upper[outside, 0]:g}, y {lower[outside, 1]:g} to {upper[outside, 1]:g} mm",
        )
    for i, field in enumerate(fields):
        shared = np.minimum(upper[i], upper[i + 1 :]) - np.maximum(lower[i], lower[i + 1 :])
        for hit in np.flatnonzero(np.all(shared > _SLACK_MM, axis=1))[:1]:
            other = fields[i + 1 + hit]
            raise other.refuse("a place of its own", f"an overlap with {field.name}")
