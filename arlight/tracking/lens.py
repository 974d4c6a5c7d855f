"""The camera's projection with lens distortion, for compiled loops; OpenCV's model with all of its 14 terms."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from arlight.camera import Camera

Array = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def project(camera, x, y):
    """Pixel of normalised image coordinates; camera: fx, fy, cx, cy, 12 distortion terms, 9 of the tilt (OpenCV)."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (camera[4] + r2 * (camera[5] + r2 * camera[8]))
    radial /= 1.0 + r2 * (camera[9] + r2 * (camera[10] + r2 * camera[11]))
    p1, p2 = camera[6], camera[7]
    xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (camera[12] + r2 * camera[13])
    yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (camera[14] + r2 * camera[15])
    w = camera[22] * xd + camera[23] * yd + camera[24]
    xt = (camera[16] * xd + camera[17] * yd + camera[18]) / w
    yt = (camera[19] * xd + camera[20] * yd + camera[21]) / w
    return camera[0] * xt + camera[2], camera[1] * yt + camera[3]


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
