"""The camera of a clip that came without one, from the sheet in the clip itself."""

from collections.abc import Iterable, Sized
from dataclasses import dataclass

import numpy as np

from arlight.calibration.camera.camera_fit import CameraFit, Expectation
from arlight.calibration.camera.marker_points import MarkerPoints
from arlight.calibration.camera.sheet_pictures import TargetPicture, fit_sheet
from arlight.calibration.camera.view_selection import select_views
from arlight.camera import Camera
from arlight.errors import CalibrationError
from arlight.probe.design import Probe
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader

_SEARCHED = 20
"""Pictures with the sheet that are looked for."""
_FIRST_FRAMES = 240
"""Frames of a long clip over which the pictures are spread, counted from where the sheet appears."""
_MOST_VIEWS = 12
WORST_FOCAL_STDDEV = 0.02
"""Standard deviation of the focal length, relative to it, beyond which it is not determined."""
_TYPICAL_TILT_DEG = 15.0


@dataclass(frozen=True, slots=True)
class CameraEstimate:
    """A camera estimated from footage, and how far it can be trusted."""

    camera: Camera
    """Square pixels (unless the stream says otherwise), principal point near the centre, little distortion."""
    focal_stddev: float
    """Standard deviation of the focal length, relative to it."""
    residual_px: float
    """Robust standard deviation of the markers' places from where the camera puts them, per coordinate [px]."""
    frames: tuple[int, ...]
    """Numbers of the frames that it rests on."""

    @property
    def summary(self) -> str:
        """One line for the user."""
        k = self.camera.camera_matrix
        return (
            f"no camera.json: focal length {k[1, 1]:.0f} px +- {100.0 * self.focal_stddev:.2g} % estimated from the "
            f"sheet in {len(self.frames)} frame{'s' if len(self.frames) > 1 else ''} ({self.residual_px:.2f} px left)"
        )


def estimate_camera(
    frames: VideoReader | Iterable[Frame], probe: Probe, frame_count: int | None = None, pixel_aspect: float = 1.0
) -> CameraEstimate:
    """Focal length, and what else of the camera the clip tells.

    1. The sheet's markers are found in frames spread over the clip; sharp frames that differ are kept.
    2. Bundle adjustment of the markers' centres, with the principal point expected near the picture's centre and
       little distortion: what the clip does not determine stays as expected.
    3. The markers are aligned under that camera, and the camera is adjusted again.

    Args:
        frames: the clip; read only as far as is needed.
        probe: the sheet in it.
        frame_count: how many frames there are; a reader or a list says so itself.
        pixel_aspect: width of a pixel relative to its height; a reader says so itself.

    Raises:
        CalibrationError: the sheet was not found, or its views do not determine the focal length.
    """
    if isinstance(frames, VideoReader):
        frame_count = frames.frame_count if frame_count is None else frame_count
        pixel_aspect = float(frames.pixel_aspect or pixel_aspect)
    elif isinstance(frames, Sized) and frame_count is None:
        frame_count = len(frames)
    points = MarkerPoints(probe)
    found = _candidates(frames, points, frame_count)
    if not found:
        raise CalibrationError(
            "the camera cannot be estimated from the clip: no frame shows four of the sheet's markers; give the "
            "camera that filmed it (--camera FILE; `arlight calibrate camera` makes one), and check --probe"
        )
    size = found[0].size
    kept = select_views([p.view for p in found], [p.sharpness for p in found], size, _MOST_VIEWS)
    chosen = [found[k] for k in kept]
    fit = fit_sheet(chosen, points, Expectation.of_footage(size, pixel_aspect))
    if fit is None or not fit.focal_stddev < WORST_FOCAL_STDDEV:
        raise _undetermined(fit)
    return CameraEstimate(fit.camera, fit.focal_stddev, fit.stddev_px, tuple(p.index for p in chosen))


def _candidates(frames: Iterable[Frame], points: MarkerPoints, frame_count: int | None) -> list[TargetPicture]:
    """Pictures in which the sheet was found, evenly apart in time."""
    stride = max(1, min(frame_count or _FIRST_FRAMES, _FIRST_FRAMES) // _SEARCHED)
    found: list[TargetPicture] = []
    for number, frame in enumerate(frames):
        if number % stride:
            continue
        picture = TargetPicture.of_sheet(frame, points, str(frame.index))
        if picture is not None:
            found.append(picture)
        if len(found) >= _SEARCHED:
            break
    return found


def _undetermined(fit: CameraFit | None) -> CalibrationError:
    if fit is None:
        found = "no camera explains where its markers are seen"
    else:
        tilts = [np.degrees(np.arccos(np.clip(-pose.rotation[2, 2], -1.0, 1.0))) for pose in fit.poses]
        found = f"it is determined to {100.0 * fit.focal_stddev:.1f} % only ({100.0 * WORST_FOCAL_STDDEV:g} % needed)"
        if max(tilts) < _TYPICAL_TILT_DEG:
            found += f", the sheet is seen from straight above (at most {max(tilts):.0f} degrees off)"
        else:
            found += f", from {len(fit.poses)} distinct view{'s' if len(fit.poses) > 1 else ''}"
    return CalibrationError(
        f"the focal length cannot be estimated from the clip: {found}; film the sheet large in the picture and from 30 "
        "to 55 degrees off its normal while the camera moves around it, or give the camera (--camera FILE; `arlight "
        "calibrate camera` makes one)"
    )
