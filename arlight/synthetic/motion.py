"""Paths of the camera over the sheet."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import ArlightError

PathName = Literal["still", "orbit", "low", "approach", "handheld"]
PATHS: tuple[PathName, ...] = get_args(PathName)

EDGE_PX = 6.0


@dataclass(frozen=True, slots=True)
class Stand:
    """Where the camera stands, relative to the sheet, before it is aimed."""

    tilt_deg: float
    """Angle between the line to the camera and the sheet's normal [deg]."""
    azimuth_deg: float = -90.0
    """Azimuth of the camera about the sheet's centre, from +x toward +y; -90 is before its lower edge [deg]."""
    roll_deg: float = 0.0
    """Turn of the camera about its axis [deg]."""
    closeness: float = 1.0
    """Sheet's width in the picture relative to the path's."""


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """A camera that moves over the sheet and keeps it in the picture."""

    path: PathName = "orbit"
    """`still`; `orbit`: an arc 35 to 55 degrees off the normal; `low`: 60 to 70 degrees off; `approach`: from far to
    near; `handheld`: a hand's smooth shake."""
    sheet_width_px: float = 650.0
    """Width of the sheet at the distance of its centre [px]; less where the sheet would leave the picture."""
    tilt_deg: float | None = None
    """Angle off the normal around which the path goes, 0 to 80; None for the path's own [deg]."""
    duration_s: float = 5.0
    """Time for the whole path [s]."""
    seed: int = 0
    """Chooses the shake of `handheld`."""

    def __post_init__(self) -> None:
        if self.path not in PATHS:
            raise ArlightError(f"unknown camera path {self.path!r}; choose one of {', '.join(PATHS)}")
        if self.tilt_deg is not None and not 0.0 <= self.tilt_deg <= 80.0:
            raise ArlightError(f"tilt_deg must lie between 0 and 80 degrees off the normal, found {self.tilt_deg}")
        if not (np.isfinite(self.sheet_width_px) and self.sheet_width_px >= 20.0):
            raise ArlightError(f"sheet_width_px must be at least 20 pixels, found {self.sheet_width_px}")
        if not (np.isfinite(self.duration_s) and self.duration_s > 0.0):
            raise ArlightError(f"duration_s must be a positive time in seconds, found {self.duration_s}")

    def pose(self, time_s: float, camera: Camera, sheet_mm: tuple[float, float]) -> Pose:
        """camera_from_probe at a time; the sheet's outline lies centred in the picture, wholly inside it.

        Args:
            time_s: time since the start [s].
            camera: intrinsics and lens distortion.
            sheet_mm: width and height of the sheet [mm].
        """
        stand = _STANDS[self.path](time_s, self)
        focal_px = camera.camera_matrix[0, 0]
        distance_mm = focal_px * sheet_mm[0] / (self.sheet_width_px * stand.closeness)
        half = np.array(sheet_mm) / 2.0
        outline = np.array([[x, y, 0.0] for x in (-half[0], 0, half[0]) for y in (-half[1], 0, half[1])])
        aim = np.zeros(3)
        pose = _look_at(stand, distance_mm, aim)
        for _ in range(8):
            pixels = camera.project(pose, outline)
            low, high = pixels.min(axis=0), pixels.max(axis=0)
            room = np.array(camera.image_size) - 1.0 - 2.0 * EDGE_PX
            distance_mm *= max(1.0, float(np.max((high - low) / room)))
            aim = aim + _on_sheet(pose, camera, (low + high) / 2.0) - _on_sheet(pose, camera, _centre_px(camera))
            pose = _look_at(stand, distance_mm, aim)
        return pose


def _centre_px(camera: Camera) -> NDArray[np.float64]:
    return (np.array(camera.image_size) - 1.0) / 2.0


def _on_sheet(pose: Pose, camera: Camera, pixel: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the ray through a pixel meets z = 0, probe frame [mm]."""
    ray = pose.rotation.T @ np.append(camera.rays(pixel[None])[0], 1.0)
    centre = pose.camera_centre_mm
    return centre - ray * centre[2] / ray[2]


def _look_at(stand: Stand, distance_mm: float, aim_mm: NDArray[np.float64]) -> Pose:
    tilt, azimuth, roll = np.deg2rad([stand.tilt_deg, stand.azimuth_deg, stand.roll_deg])
    centre = distance_mm * np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    forward = aim_mm - centre
    forward = forward / np.linalg.norm(forward)
    # right is horizontal, defined at the normal too
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    right = right - forward * (right @ forward)
    right = right / np.linalg.norm(right)
    down = np.cross(forward, right)
    right, down = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
    rotation = np.stack([right, down, forward])
    return Pose(rotation, -rotation @ centre)


def _still(_time_s: float, motion: CameraMotion) -> Stand:
    return Stand(40.0 if motion.tilt_deg is None else motion.tilt_deg)


def _orbit(time_s: float, motion: CameraMotion) -> Stand:
    along = time_s / motion.duration_s
    middle = 45.0 if motion.tilt_deg is None else motion.tilt_deg
    # lowest at the ends of the arc, where the turned sheet would not fit the picture otherwise
    tilt = middle + 10.0 * np.cos(2.0 * np.pi * along)
    return Stand(float(np.clip(tilt, 0.0, 85.0)), azimuth_deg=-90.0 - 26.0 * np.cos(np.pi * along))


def _low(time_s: float, motion: CameraMotion) -> Stand:
    along = time_s / motion.duration_s
    middle = 65.0 if motion.tilt_deg is None else motion.tilt_deg
    tilt = middle - 5.0 * np.cos(np.pi * along)
    return Stand(float(np.clip(tilt, 0.0, 85.0)), azimuth_deg=-90.0 + 18.0 * np.sin(np.pi * along))


def _approach(time_s: float, motion: CameraMotion) -> Stand:
    along = min(max(time_s / motion.duration_s, 0.0), 1.0)
    smooth = along * along * (3.0 - 2.0 * along)
    tilt = 45.0 if motion.tilt_deg is None else motion.tilt_deg
    return Stand(tilt, azimuth_deg=-96.0, closeness=0.45 + 0.55 * smooth)


def _handheld(time_s: float, motion: CameraMotion) -> Stand:
    generator = np.random.default_rng(motion.seed)
    hertz = np.array([0.23, 0.41, 0.83, 1.7, 2.9])
    weight = np.array([1.0, 0.7, 0.4, 0.12, 0.05])
    phase = generator.uniform(0.0, 2.0 * np.pi, (4, len(hertz)))
    shake = np.sin(2.0 * np.pi * hertz * time_s + phase) @ weight
    tilt = (42.0 if motion.tilt_deg is None else motion.tilt_deg) + 3.0 * shake[0]
    return Stand(
        float(np.clip(tilt, 0.0, 85.0)),
        azimuth_deg=-90.0 + 5.0 * shake[1],
        roll_deg=2.0 * shake[2],
        closeness=0.92 + 0.04 * shake[3],
    )


_STANDS: dict[PathName, Callable[[float, CameraMotion], Stand]] = {
    "still": _still,
    "orbit": _orbit,
    "low": _low,
    "approach": _approach,
    "handheld": _handheld,
}
