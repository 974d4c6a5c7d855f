"""The camera's projection with lens distortion as compiled loops read it (lens.h); OpenCV's model, all 14 terms."""

import math

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera

Array = NDArray[np.float64]


def camera_parameters(camera: Camera) -> Array:
    """(25,) focal lengths, principal point, 12 distortion terms, and the 3x3 tilt of the sensor, as in OpenCV."""
    k = camera.camera_matrix
    distortion = np.zeros(14)
    distortion[: camera.distortion.size] = camera.distortion
    return np.concatenate(
        [[k[0, 0], k[1, 1], k[0, 2], k[1, 2]], distortion[:12], _tilt(distortion[12], distortion[13]).ravel()]
    )


def _tilt(around_x: float, around_y: float) -> Array:
    """Homography of a sensor tilted by two angles [rad] (OpenCV's tilted model)."""
    cx, sx, cy, sy = math.cos(around_x), math.sin(around_x), math.cos(around_y), math.sin(around_y)
    rotation = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    onto = np.array([[rotation[2, 2], 0, -rotation[0, 2]], [0, rotation[2, 2], -rotation[1, 2]], [0, 0, 1]])
    return onto @ rotation
