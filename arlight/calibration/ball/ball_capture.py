"""From photographs of a ball beside the sheet to a `BallPicture`: merge, find sheet and ball, check the exposures."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.calibration.ball.ball_detection import FoundBall, ball_at, find_ball
from arlight.calibration.ball.ball_outline import BallOutline, project_rays
from arlight.calibration.ball.exposure_merge import MergedRadiance, merge_exposures
from arlight.calibration.ball.mirror_ball import BallPicture
from arlight.calibration.ball.photographs import Photograph, PhotographError
from arlight.camera import Camera, Pose
from arlight.color import Transfer
from arlight.errors import ProbeError
from arlight.probe.design import Probe
from arlight.tracking.luma import luma_codes
from arlight.tracking.recognition import markers_of
from arlight.tracking.tracker import PoseTracker
from arlight.video.frame import Frame

_MOST_CLIPPED = 3e-4
"""Share of the ball's picture: ten of the 31000 pixels of a ball 200 pixels wide."""
_MOST_BLACK = 0.3
_MOST_MOTION_PX = 1.5
_DARK_CODE, _WANTED_LINEAR = 8, 0.2


@dataclass(frozen=True, slots=True)
class CaptureSettings:
    """How photographs become a picture of the ball."""

    transfer: Transfer = "srgb"
    """How the camera encodes light."""
    allow_clipped: bool = False
    """Take a picture whose lamps clip: the light is then a lower bound."""


@dataclass(frozen=True, slots=True)
class CapturedBall:
    """What one view's photographs showed."""

    picture: BallPicture
    """Radiance, sheet and ball."""
    found: FoundBall
    """How well the ball was seen."""
    clipped_share: float
    """Share of the ball's picture that clips even at the shortest exposure."""


def capture_ball(
    photographs: Sequence[Photograph],
    probe: Probe,
    camera: Camera,
    reference_s: float,
    settings: CaptureSettings | None = None,
    circle: tuple[float, float, float] | None = None,
) -> CapturedBall:
    """Picture of a ball from one camera position.

    1. The pictures are merged to radiance.
    2. The sheet's pose is taken from the picture that shows its markers best.
    3. The ball is found, or refined from the circle.
    4. Lamps that clip and a ball that stays black are refused.

    Args:
        photographs: one picture, or a bracket.
        probe: the sheet in them.
        camera: that took them.
        reference_s: exposure at which radiance 1 is full scale [s].
        settings: how they are taken.
        circle: x, y and radius of the ball [px]; looked for by default.

    Raises:
        PhotographError: the pictures do not fit each other or the camera, or their exposures miss the light.
        ProbeError: the sheet is not in them.
        BallError: the ball is not in them.
    """
    settings = settings or CaptureSettings()
    _check_camera(photographs, camera)
    _check_levels(photographs)
    merged = merge_exposures(photographs, reference_s, settings.transfer)
    pose = _sheet_pose(photographs, probe, camera, settings.transfer)
    if circle is None:
        found = find_ball(merged.radiance, camera)
    else:
        found = ball_at(merged.radiance, camera, circle[:2], circle[2])
    inside = ball_mask(camera, found.outline)
    clipped_share = float(np.mean(merged.clipped[inside]))
    _check_black(photographs, merged, inside, reference_s)
    if clipped_share > _MOST_CLIPPED and not settings.allow_clipped:
        raise _clipping(photographs, clipped_share)
    picture = BallPicture(merged.radiance, merged.clipped, camera, pose, found.outline)
    return CapturedBall(picture, found, clipped_share)


def ball_mask(camera: Camera, outline: BallOutline) -> NDArray[np.bool_]:
    """(h, w) the pixels of the ball."""
    contour = project_rays(camera, outline.contour_rays(180))
    mask = np.zeros(camera.image_size[::-1], np.uint8)
    cv2.fillPoly(mask, [np.rint(contour).astype(np.int32)], 1)
    return mask > 0


def _sheet_pose(photographs: Sequence[Photograph], probe: Probe, camera: Camera, transfer: Transfer) -> Pose:
    seen: list[tuple[float, Pose, str]] = []
    for photograph in photographs:
        codes, table = luma_codes(Frame.from_rgb(photograph.encoded, transfer=transfer))
        pose = PoseTracker(probe, camera).update(codes, 0.0, table)
        if pose.camera_from_probe is not None:
            seen.append((pose.reprojection_rms_px, pose.camera_from_probe, photograph.name))
    if not seen:
        raise ProbeError(
            f"{photographs[0].name}: the sheet (markers {markers_of(probe)}) was not found in this view's pictures; it "
            "must be in the same picture as the ball, well exposed in at least one, and be the one of --probe"
        )
    _, best, best_name = min(seen, key=lambda entry: entry[0])
    corners = camera.project(best, probe.outline_mm)
    for _, pose_of_other, name in seen:
        moved = float(np.median(np.linalg.norm(camera.project(pose_of_other, probe.outline_mm) - corners, axis=1)))
        if moved > _MOST_MOTION_PX:
            raise PhotographError(
                f"{name}: the sheet lies {moved:.1f} pixels from where it is in {best_name}; the pictures of a bracket "
                "must be taken from one place: use a tripod, or state how many pictures a view has: --per-view N"
            )
    return best


def _check_camera(photographs: Sequence[Photograph], camera: Camera) -> None:
    width, height = camera.image_size
    for photograph in photographs:
        rows, columns = photograph.encoded.shape[:2]
        if (columns, rows) != (width, height):
            raise PhotographError(
                f"{photograph.name}: is {columns}x{rows}, the camera's image_size is {width}x{height}; give the "
                "camera.json of these pictures, or scale its intrinsics to their size"
            )


def _check_levels(photographs: Sequence[Photograph]) -> None:
    """Refuse brackets that are white or black all over, before anything is looked for in them."""
    shortest = min(photographs, key=lambda photograph: photograph.exposure_s)
    longest = max(photographs, key=lambda photograph: photograph.exposure_s)
    white = float(np.mean(np.all(shortest.encoded == 255, axis=-1)))
    if white > 0.5:
        raise PhotographError(
            f"{shortest.name}: {100.0 * white:.0f} % of the picture is clipped white, and it is the shortest exposure "
            f"({_seconds(shortest)}); expose a sixteenth of it or less"
        )
    dark = float(np.mean(np.all(longest.encoded < _DARK_CODE, axis=-1)))
    if dark > 0.95:
        raise PhotographError(
            f"{longest.name}: {100.0 * dark:.0f} % of the picture is black, and it is the longest exposure "
            f"({_seconds(longest)}); expose at least sixteen times as long"
        )


def _check_black(
    photographs: Sequence[Photograph], merged: MergedRadiance, inside: NDArray[np.bool_], reference_s: float
) -> None:
    longest = max(photographs, key=lambda photograph: photograph.exposure_s)
    dark = np.all(longest.encoded[inside] < _DARK_CODE, axis=-1)
    if np.mean(dark) > _MOST_BLACK:
        median = max(float(np.median(merged.radiance[inside])), 1e-9)
        wanted = _WANTED_LINEAR * reference_s / median
        longer = float(np.clip(wanted, 4.0 * longest.exposure_s, 64.0 * longest.exposure_s))
        raise PhotographError(
            f"{longest.name}: {100.0 * float(np.mean(dark)):.0f} % of the ball is black even at the longest exposure "
            f"({_seconds(longest)}); add one of about {longer:.3g} s"
        )


def _clipping(photographs: Sequence[Photograph], share: float) -> PhotographError:
    shortest = min(photographs, key=lambda photograph: photograph.exposure_s)
    needed = shortest.exposure_s / (4.0 if share < 0.005 else 16.0)
    return PhotographError(
        f"{shortest.name}: {100.0 * share:.2f} % of the ball is clipped white even at the shortest exposure "
        f"({_seconds(shortest)}), up to {100.0 * _MOST_CLIPPED:g} % can be: lamps are brighter than that; add a "
        f"picture of {needed:.3g} s or less, or take the light as a lower bound: --allow-clipped"
    )


def _seconds(photograph: Photograph) -> str:
    return f"{photograph.exposure_s:.3g} s"
