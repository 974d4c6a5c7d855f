"""A camera's intrinsics from pictures of a board or of the sheet, and when the pictures do not tell them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.camera_fit import CameraFit, Expectation, fit_camera
from arlight.calibration.camera.sheet_pictures import TargetPicture
from arlight.calibration.camera.view_selection import select_views
from arlight.camera import Camera, Pose
from arlight.errors import CalibrationError

Array = NDArray[np.float64]
Fitter = Callable[[Sequence[TargetPicture], Expectation], CameraFit | None]

MOST_VIEWS = 30
_FEWEST_VIEWS = 4
_FEWEST_POINTS = 60
_WORST_FOCAL_STDDEV = 0.004
_WORST_CENTRE_STDDEV = 0.01
"""Standard deviation of the principal point, relative to the picture's longer side."""
_WORST_RESIDUAL_PX = 1.0
_ALIKE_DEG = 10.0
_GRID = 8

HOW_TO = (
    "film the target large in the picture from at least six directions, 20 to 50 degrees off its normal to different "
    "sides, with the camera turned upright once, into the corners of the picture too"
)


@dataclass(frozen=True, slots=True)
class CameraCalibration:
    """Intrinsics with their uncertainty, and the views that they rest on."""

    camera: Camera
    """Intrinsics with lens distortion."""
    fit: CameraFit
    """Covariance, poses and residuals."""
    names: tuple[str, ...]
    """The views' pictures."""
    coverage: float
    """Share of the picture, counted in 8 x 8 cells, in which the target was seen."""


def calibrate_views(pictures: Sequence[TargetPicture], fitter: Fitter | None = None) -> CameraCalibration:
    """Intrinsics from pictures in which the target was found.

    1. Pictures of different sizes are refused; sharp ones that differ from each other are chosen.
    2. Bundle adjustment with the five terms of Brown's lens.
    3. What the views leave open is refused, by the covariance of focal length and principal point.

    Args:
        pictures: with the target's points.
        fitter: adjusts the camera to the chosen pictures; by default to the points as detected.

    Raises:
        CalibrationError: the pictures do not determine the camera; the message says why and what to do.
    """
    if not pictures:
        raise CalibrationError(
            "no picture shows the target: give pictures or a video of the printed board (or --probe for the sheet), "
            "sharp, evenly lit, at least a quarter of the picture wide"
        )
    size = _one_size(pictures)
    kept = select_views([p.view for p in pictures], [p.sharpness for p in pictures], size, MOST_VIEWS)
    chosen = [pictures[k] for k in kept]
    if len(chosen) < _FEWEST_VIEWS:
        raise CalibrationError(
            f"the views are all alike: {len(chosen)} of {len(pictures)} pictures differ, at least {_FEWEST_VIEWS} "
            f"must; {HOW_TO}"
        )
    points = sum(len(picture.view.points_mm) for picture in chosen)
    if points < _FEWEST_POINTS:
        raise CalibrationError(
            f"too few corners: {points} in {len(chosen)} views, at least {_FEWEST_POINTS} are needed; show more of the "
            f"target; {HOW_TO}"
        )
    expected = Expectation.of_calibration(size)
    fit = fit_camera([p.view for p in chosen], size, expected) if fitter is None else fitter(chosen, expected)
    _check(fit)
    assert fit is not None
    return CameraCalibration(fit.camera, fit, tuple(p.view.name for p in chosen), _coverage(chosen, size))


def _one_size(pictures: Sequence[TargetPicture]) -> tuple[int, int]:
    size = pictures[0].size
    for picture in pictures:
        if picture.size != size:
            raise CalibrationError(
                f"the pictures differ in size: {pictures[0].view.name} has {size[0]}x{size[1]}, {picture.view.name} "
                f"has {picture.size[0]}x{picture.size[1]}; calibrate each resolution and each zoom by itself"
            )
    return size


def _check(fit: CameraFit | None) -> None:
    """Refuse what the views leave open.

    Raises:
        CalibrationError: always with the reason.
    """
    if fit is None:
        raise CalibrationError(f"no camera explains where the target is seen; {HOW_TO}")
    if fit.stddev_px > _WORST_RESIDUAL_PX:
        raise CalibrationError(
            f"the target does not fit the pictures: its points are {fit.stddev_px:.1f} px off, up to "
            f"{_WORST_RESIDUAL_PX:g} px can be; check that it is flat, that --columns and --rows (or --probe) are the "
            "printed target's, and that the zoom did not change"
        )
    width = max(fit.camera.image_size)
    centre = float(np.sqrt(np.max(np.diag(fit.covariance)[2:4]))) / width
    if fit.focal_stddev < _WORST_FOCAL_STDDEV and centre < _WORST_CENTRE_STDDEV:
        return
    normals = np.array([_normal_in_camera(pose) for pose in fit.poses])
    spread = np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1.0, 1.0)))
    tilts = np.degrees(np.arccos(np.clip(-normals[:, 2], -1.0, 1.0)))
    if tilts.max() < _ALIKE_DEG:
        reason = f"all views are from straight above (at most {tilts.max():.0f} degrees off the target's normal)"
    elif spread < _ALIKE_DEG:
        reason = f"all views are from about one direction (within {spread:.0f} degrees)"
    else:
        reason = "the views are too few, too small in the picture, or too much alike"
    raise CalibrationError(
        f"the focal length and centre are not determined ({100.0 * fit.focal_stddev:.1f} % and {centre * width:.0f} px "
        f"uncertain): {reason}; {HOW_TO}"
    )


def _normal_in_camera(pose: Pose) -> Array:
    normal: Array = pose.rotation[:, 2]
    return normal


def _coverage(pictures: Sequence[TargetPicture], size: tuple[int, int]) -> float:
    pixels = np.concatenate([picture.view.pixels for picture in pictures])
    cells = np.floor(pixels / np.array(size) * _GRID).astype(int).clip(0, _GRID - 1)
    return len(np.unique(cells, axis=0)) / _GRID**2
