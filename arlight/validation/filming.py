"""The proof's sheet, camera, paths and lights, and what the camera makes of the light."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.synthetic.motion import Stand
from arlight.synthetic.sensor import Sensor

Image = NDArray[np.float32]
TracedPath = Literal["orbit", "dive", "hand"]
TRACED_PATHS: tuple[TracedPath, ...] = get_args(TracedPath)

SHEET_WIDTH_PX = 520.0
WHITE = 0.7
"""Linear value of white paper under clear film in its brightest channel, about: the exposure."""
_EDGE_PX = 8.0
_SENSOR = Sensor(blur_px=0.6, vignetting=0.0, read_noise=0.002, gain=0.0003)


def assembled_by_hand() -> Assembly:
    """Everything at once: 0.1 mm and 0.3 degrees between film and paper, 2 % of thickness, blur, dot gain, grey ink."""
    film = Registration((0.02, 0.03), 0.03)
    between = np.array([0.08, -0.06])
    shift = np.array(film.shift_mm) + film.matrix @ between
    paper = Registration((float(shift[0]), float(shift[1])), film.rotation_deg + 0.3)
    return Assembly(
        film=Print(film, blur_mm=0.1, dot_gain=0.1, solid=0.02),
        paper=Print(paper, blur_mm=0.1, dot_gain=0.1, solid=0.04),
        glass_scale=1.02,
    )


def proof_camera() -> Camera:
    """A phone-like camera: 60 degrees across, a slight barrel distortion, the principal point off the centre, a
    darkening of 15 % toward the corners."""
    matrix = np.array([[1100.0, 0.0, 643.0], [0.0, 1100.0, 356.0], [0.0, 0.0, 1.0]])
    return Camera((1280, 720), matrix, np.array([-0.05, 0.0, 0.0, 0.0, 0.0]), vignetting=(-0.12, -0.03, 0.0))


def stand_on(path: TracedPath, along: float) -> Stand:
    """Where the camera stands.

    Args:
        path: `orbit`: 35 degrees off the normal, over 50 degrees of azimuth; `dive`: from 20 to 60 degrees while it
            comes and goes; `hand`: a hand's wobble with a pan, around 45 degrees.
        along: share of the path, 0 to 1.
    """
    turn = 2.0 * np.pi * along
    match path:
        case "orbit":
            return Stand(35.0 + 1.5 * np.sin(turn), -115.0 + 50.0 * along)
        case "dive":
            smooth = along * along * (3.0 - 2.0 * along)
            return Stand(20.0 + 40.0 * smooth, -82.0, closeness=0.95 + 0.25 * np.sin(np.pi * along))
        case "hand":
            return Stand(
                45.0 + 4.0 * np.sin(1.3 * turn + 0.4) + 1.2 * np.sin(3.7 * turn),
                -98.0 + 14.0 * along + 3.0 * np.sin(2.1 * turn + 1.0),
                roll_deg=5.0 * np.sin(0.9 * turn + 2.0) + 1.0 * np.sin(4.3 * turn),
                closeness=1.0 + 0.04 * np.sin(1.7 * turn + 0.5),
            )


def pose_at(stand: Stand, camera: Camera, sheet_mm: tuple[float, float]) -> Pose:
    """camera_from_probe that looks at the sheet; farther than asked for where the sheet would leave the picture."""
    distance_mm = camera.camera_matrix[0, 0] * sheet_mm[0] / (SHEET_WIDTH_PX * stand.closeness)
    half = np.array(sheet_mm) / 2.0
    corners = np.array([[x, y, 0.0] for x in (-half[0], half[0]) for y in (-half[1], half[1])])
    aim = np.zeros(3)
    for _ in range(12):
        pose = _looking(stand, distance_mm, aim)
        pixels = camera.project(pose, corners)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        room = np.array(camera.image_size) - 1.0 - 2.0 * _EDGE_PX
        distance_mm *= max(1.0, float(np.max((high - low) / room)))
        # the middle of what is seen, moved to the middle of the picture
        off = (low + high) / 2.0 - (np.array(camera.image_size) - 1.0) / 2.0
        step = distance_mm / camera.camera_matrix[0, 0] * (pose.rotation[:2].T @ off)
        aim = aim + [step[0], step[1], 0.0]
    return _looking(stand, distance_mm, aim)


def _looking(stand: Stand, distance_mm: float, aim_mm: NDArray[np.float64]) -> Pose:
    tilt, azimuth, roll = np.deg2rad([stand.tilt_deg, stand.azimuth_deg, stand.roll_deg])
    toward = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    down = np.cross(-toward, right)
    right, down = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
    rotation = np.stack([right, down, -toward])
    return Pose(rotation, -rotation @ (aim_mm + distance_mm * toward))


@dataclass(frozen=True, slots=True)
class ProofSensor:
    """A camera with radial vignetting, defocus, noise, the sRGB curve and 8 bits."""

    noisy: bool = True
    """Whether the sensor has noise."""

    def expose(self, radiance: Image, camera: Camera, generator: np.random.Generator) -> NDArray[np.uint8]:
        """One 8-bit picture (h, w, 3) of linear radiance (h, w, 3)."""
        sensor = _SENSOR if self.noisy else Sensor(_SENSOR.blur_px, 0.0, 0.0, 0.0)
        return sensor.expose(radiance * vignetting(camera)[..., None], camera, generator)


def vignetting(camera: Camera) -> Image:
    """(h, w) recorded over incident light."""
    width, height = camera.image_size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    return camera.gain(pixels).reshape(height, width).astype(np.float32)
