"""The pose of the sheet from frame to frame: acquire, predict, align, and acquire again after a loss."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.color import linear_from_encoded
from arlight.errors import CameraError
from arlight.probe.design import Probe
from arlight.tracking.alignment import SAMPLING_VARIANCE_PX2, Alignment, FiducialAlignment
from arlight.tracking.alignment_kernels import Codes, Picture, extrapolate
from arlight.tracking.fiducials import FiducialDetector
from arlight.tracking.planar_pose import poses_from_detections
from arlight.tracking.pose import ProbePose

_TYPICAL_BLUR_PX = 0.8
_BLUR_RATE = 0.2
"""Share of a new frame in the running estimate of the blur."""
_REMEMBERED_S = 1.0
"""How long after a loss the last pose is still worth a try [s]."""

_WIDEST = 8
"""Shrinkage of the first level where a pose is known to some 10 px only."""
_SHRINKAGES = (2, 1, _WIDEST)
"""First levels to try, in turn: the usual one, one for markers of few pixels, one for a first guess that is far off."""
_MOST_LEVELS = 4
_TIE = 0.02
"""Sums of the markers' correlations that differ by less are no reason to prefer one pose."""


@dataclass(frozen=True, slots=True)
class _Sighting:
    """A pose that was measured, and when."""

    pose: Pose
    time_s: float


class PoseTracker:
    """Finds the sheet and follows it.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera that filmed it.
        alignment_levels: levels of resolution that a predicted pose is aligned on, 1 to 4; with 1 coarser ones are
            only turned to where the finest loses markers.

    Raises:
        ProbeError: the sheet has no fiducials that ArUco knows.
        ValueError: another number of levels.
    """

    def __init__(self, probe: Probe, camera: Camera, alignment_levels: int = 1) -> None:
        if not 1 <= alignment_levels <= _MOST_LEVELS:
            raise ValueError(f"alignment_levels must be 1 to {_MOST_LEVELS}, found {alignment_levels}")
        usual = 2 ** (alignment_levels - 1)
        self._shrinkages = (usual, *(shrink for shrink in _SHRINKAGES if shrink != usual))
        self._probe = probe
        self._camera = camera
        self._detector = FiducialDetector(probe)
        self._alignment = FiducialAlignment(probe, camera)
        self._srgb = linear_from_encoded(np.arange(256) / 255.0, "srgb").astype(np.float32)
        self.reset()

    def reset(self) -> None:
        """Forget everything about earlier frames."""
        self._alignment.reset()
        self._last: _Sighting | None = None
        self._before: _Sighting | None = None
        self._blur_px: float | None = None
        self._misses = 0
        self._used = 0

    def update(self, luma: Codes, time_s: float, linear_table: NDArray[np.float32] | None = None) -> ProbePose:
        """The pose in the next frame.

        Args:
            luma: (h, w) luma codes as in the stream, uint8 or uint16, of the camera's image size.
            time_s: when the frame was taken [s].
            linear_table: (2^bits,) linear light of each code; full-range sRGB of 8 bits by default.

        Returns:
            The pose; status `lost` when the sheet is not in view.

        Raises:
            CameraError: the frame's size is not the camera's.
        """
        self._check_size(luma)
        picture = Picture(luma, self._srgb if linear_table is None else np.ascontiguousarray(linear_table, np.float32))
        found = self._follow(picture, time_s) or self._acquire(picture)
        if found is None:
            self._misses += 1
            self._before = None
            return ProbePose.lost()
        self._misses = 0
        self._before, self._last = self._last, _Sighting(found.pose, time_s)
        if self._blur_px is None or not _is_like(found.blur_px, self._blur_px):
            self._blur_px = found.blur_px
        else:
            self._blur_px += _BLUR_RATE * (found.blur_px - self._blur_px)
        blur = math.sqrt(max(self._blur_px**2 - SAMPLING_VARIANCE_PX2, 0.0))
        self._used = found.count
        return ProbePose(found.pose, found.residual_rms_px, "tracked", blur, self._used)

    def _check_size(self, luma: Codes) -> None:
        width, height = self._camera.image_size
        if luma.ndim != 2 or luma.shape != (height, width):
            found = "x".join(str(side) for side in luma.shape[::-1])
            raise CameraError(
                f"the camera's image_size is {width}x{height}, the frame is {found}; "
                "use the camera.json of this footage, or scale its intrinsics to the frame's size"
            )

    def _follow(self, picture: Picture, time_s: float) -> Alignment | None:
        """Align near the predicted pose, then with a wider reach, then near the last pose.

        The first attempt that loses no marker is taken, and the second in any case; where one is hidden, the better.
        """
        if self._last is None or abs(time_s - self._last.time_s) > _REMEMBERED_S:
            return None
        predicted, last = self._last.pose, self._last
        if self._before is not None:
            predicted = predict(self._before.pose, self._before.time_s, last.pose, last.time_s, time_s)
        attempts = [*((predicted, shrink) for shrink in self._shrinkages), (last.pose, _WIDEST)]
        best: Alignment | None = None
        for start, coarsest in attempts:
            found = self._align(picture, start, coarsest)
            if found is None or not found.accepted:
                continue
            if best is not None or found.count >= self._used:
                return found if best is None else max(best, found, key=_fit)
            best = found
        return best

    def _align(self, picture: Picture, start: Pose, coarsest: int) -> Alignment | None:
        blur = self._blur_px or _TYPICAL_BLUR_PX
        found = self._alignment.align(picture, start, blur, coarsest)
        for _ in range(3):
            if found is None or _is_like(found.blur_px, blur):
                break
            # A blur that is far off widens the noise, it does not shift: the pose is a good start for the right one.
            blur = found.blur_px
            found = self._alignment.align(picture, found.pose, blur, 1)
        return found

    def _acquire(self, picture: Picture) -> Alignment | None:
        """Look for the sheet in the whole frame, and let alignment decide between the plane's two hypotheses."""
        luma = picture.eight_bits()
        for scale in self._scales():
            detections = self._detector.detect(luma, scale)
            candidates = []
            for hypothesis in poses_from_detections(self._camera, self._probe, detections):
                for shrink in _SHRINKAGES:
                    found = self._align(picture, hypothesis.pose, shrink)
                    if found is not None and found.accepted:
                        candidates.append(found)
                        break
            if candidates:
                return self._choose(candidates)
        return None

    def _choose(self, candidates: list[Alignment]) -> Alignment:
        """The candidate that fits best; of two that fit as well, the one that continues the last pose."""
        fit = [_fit(found) for found in candidates]
        close = [found for found, score in zip(candidates, fit, strict=True) if score > max(fit) - _TIE]
        if self._last is None:
            return candidates[int(np.argmax(fit))]
        last = self._last.pose.rotation
        return max(close, key=lambda found: float(np.trace(last.T @ found.pose.rotation)))

    def _scales(self) -> tuple[float, ...]:
        """Resolutions to search at: all at first and just after a loss, then one a frame, in turn."""
        scales = (0.5, 1.0, 2.0) if min(self._camera.image_size) >= 480 else (1.0, 2.0, 0.5)
        return scales if self._misses < 2 else (scales[self._misses % len(scales)],)


def _fit(found: Alignment) -> float:
    """Sum of the correlations of the markers that a pose rests on."""
    return float(np.sum(found.correlation[found.used]))


def _is_like(blur_px: float, other_px: float) -> bool:
    """Whether two estimates of the blur differ by no more than one frame's estimate is worth."""
    return abs(blur_px - other_px) < 0.25 * other_px


def predict(before: Pose, before_s: float, last: Pose, last_s: float, time_s: float) -> Pose:
    """The pose at a time if the sheet keeps turning and moving as between two sightings; no motion if time stood still.

    Args:
        before, last: poses at the times before_s and last_s [s].
        time_s: when the next frame was taken [s]; more than three intervals ahead counts as three.
    """
    elapsed = last_s - before_s
    share = min(max((time_s - last_s) / elapsed, 0.0), 3.0) if elapsed > 0.0 else 0.0
    return extrapolate(before, last, share)
