"""Pictures of the sheet as views to calibrate with: found, chosen, and adjusted in turn with the camera."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.camera_fit import CameraFit, Expectation, TargetView, fit_camera
from arlight.calibration.camera.marker_points import MarkerPoints
from arlight.calibration.camera.view_selection import edge_sharpness
from arlight.tracking.luma import luma_codes
from arlight.video.frame import Frame

_PASSES = 2
"""Alignments, each under the intrinsics of the one before."""


@dataclass(frozen=True, slots=True)
class TargetPicture:
    """A picture in which the target was found."""

    view: TargetView
    """Where it is, as detected."""
    index: int
    """Number of the frame in its source."""
    luma: NDArray[np.uint8]
    """(h, w) luma codes as in the stream."""
    table: NDArray[np.float32]
    """(256,) linear light of each code."""
    sharpness: float
    """As `edge_sharpness` measures it."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.luma.shape[1], self.luma.shape[0]

    @classmethod
    def of_sheet(cls, frame: Frame, points: MarkerPoints, name: str) -> "TargetPicture | None":
        """A frame with the sheet; None where fewer than four markers are seen."""
        codes, table = luma_codes(frame)
        view = points.detect(codes, name)
        if view is None:
            return None
        # a copy: the decoder's memory is its own
        return cls(view, frame.index, np.array(codes), table, edge_sharpness(codes, view.pixels))


def fit_sheet(pictures: Sequence[TargetPicture], points: MarkerPoints, expected: Expectation) -> CameraFit | None:
    """The camera of pictures of the sheet: adjusted to ArUco's points, then to markers aligned under that camera.

    Args:
        pictures: of one size, at least one.
        points: of the same sheet.
        expected: what is known of the camera beforehand.

    Returns:
        The fit, or None where no camera explains the pictures.
    """
    size = pictures[0].size
    views = [picture.view for picture in pictures]
    fit = fit_camera(views, size, expected)
    for _ in range(_PASSES):
        if fit is None:
            break
        aligned = [
            points.align(picture.luma, picture.table, fit.camera, pose, picture.view.name)
            for picture, pose in zip(pictures, fit.poses, strict=True)
        ]
        # a view that cannot be aligned keeps ArUco's points rather than leave the rest without its perspective
        views = [fine or picture.view for fine, picture in zip(aligned, pictures, strict=True)]
        fit = fit_camera(views, size, expected, fit.camera)
    return fit
