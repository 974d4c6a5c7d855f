"""A sheet with eight markers, and photographs of it by ray casting, which shares nothing with the tracker's model."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.color import encoded_from_linear
from arlight.probe.design import Marker, Probe

TEXELS_PER_MM = 10
MARKER_MM = 16.2


def _marker(number: int, x: float, y: float) -> Marker:
    half = MARKER_MM / 2.0
    return Marker(number, ((x - half, y + half), (x + half, y + half), (x + half, y - half), (x - half, y - half)))


@pytest.fixture(scope="session")
def sheet() -> Probe:
    """160 mm square, markers around a field."""
    places = [(-66, 66), (0, 66), (66, 66), (66, 0), (66, -66), (0, -66), (-66, -66), (-66, 0)]
    markers = tuple(_marker(number, float(x), float(y)) for number, (x, y) in enumerate(places))
    return Probe("matched", 3, (160.0, 160.0), 20, 2.44, 1.52, "DICT_4X4_50", markers, ())


@pytest.fixture(scope="session")
def reflectance(sheet: Probe) -> np.ndarray:
    """(rows, columns) what is printed, row 0 at the top edge: markers on white around a field of waves."""
    columns, rows = (round(side * TEXELS_PER_MM) for side in sheet.sheet_mm)
    x, y = np.meshgrid((np.arange(columns) + 0.5) / TEXELS_PER_MM - 80, 80 - (np.arange(rows) + 0.5) / TEXELS_PER_MM)
    print_ = np.where((abs(x) < 54) & (abs(y) < 54), 0.4 + 0.35 * np.sin(2.1 * x + 0.7 * y) * np.cos(1.7 * y), 0.85)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    side = round(MARKER_MM * TEXELS_PER_MM)
    for marker in sheet.markers:
        left, top = marker.corners_mm[0]
        column, row = round((left + 80) * TEXELS_PER_MM), round((80 - top) * TEXELS_PER_MM)
        image = dictionary.generateImageMarker(marker.id, side, borderBits=1)
        print_[row : row + side, column : column + side] = np.where(image > 0, 0.85, 0.04)
    return print_


@pytest.fixture(scope="session")
def camera() -> Camera:
    """A small ideal camera."""
    return Camera((640, 480), np.array([[620.0, 0, 318.0], [0, 625.0, 243.0], [0, 0, 1]]), np.zeros(5))


@pytest.fixture(scope="session")
def bent_camera() -> Camera:
    """The same with a strong lens distortion."""
    return Camera(
        (640, 480),
        np.array([[620.0, 0, 318.0], [0, 625.0, 243.0], [0, 0, 1]]),
        np.array([-0.22, 0.11, 2e-3, -3e-3, 0.03]),
    )


@pytest.fixture(scope="session")
def photograph(reflectance: np.ndarray) -> Callable[..., np.ndarray]:
    """(h, w) sRGB picture: sub-pixel rays averaged in linear light, lens blur, noise, eight bits.

    light: irradiance at (x, y) [mm] of the sheet; cover: after the camera, a function of the linear picture.
    """

    def take(camera, pose, blur_px=0.5, noise=0.003, light=None, cover=None, seed=0, table=0.2, across=5):
        rays = np.pad(camera.ray_map.astype(float), ((1, 1), (1, 1), (0, 0)), "reflect", reflect_type="odd")
        middle = rays[1:-1, 1:-1]
        ahead, down = (rays[1:-1, 2:] - rays[1:-1, :-2]) / 2, (rays[2:, 1:-1] - rays[:-2, 1:-1]) / 2
        centre = pose.camera_centre_mm
        linear = np.zeros(middle.shape[:2])
        offsets = (np.arange(across) + 0.5) / across - 0.5
        for dx, dy in ((dx, dy) for dx in offsets for dy in offsets):
            x, y = np.moveaxis(middle + dx * ahead + dy * down, -1, 0)
            toward = [pose.rotation[0, k] * x + pose.rotation[1, k] * y + pose.rotation[2, k] for k in range(3)]
            reach = centre[2] / np.maximum(-toward[2], 1e-9)
            on_x, on_y = centre[0] + reach * toward[0], centre[1] + reach * toward[1]
            column = np.floor((on_x + 80) * TEXELS_PER_MM).astype(int)
            row = np.floor((80 - on_y) * TEXELS_PER_MM).astype(int)
            size = reflectance.shape[0]
            on = (toward[2] < 0) & (column >= 0) & (row >= 0) & (column < size) & (row < size)
            value = np.where(on, reflectance[row.clip(0, size - 1), column.clip(0, size - 1)], table)
            linear += value if light is None else value * light(on_x, on_y)
        linear /= across**2
        if blur_px > 0:
            linear = cv2.GaussianBlur(linear, (0, 0), blur_px)
        if cover is not None:
            linear = cover(linear)
        linear = linear + noise * np.random.default_rng(seed).normal(size=linear.shape)
        return np.round(encoded_from_linear(linear) * 255).astype(np.uint8)

    return take


@pytest.fixture(scope="session")
def pose_error_px() -> Callable[..., tuple[float, np.ndarray]]:
    """Rms distance over the sheet between two poses' pixels, and their mean difference."""
    places = np.linspace(-80, 80, 9)
    grid = np.array([[x, y, 0.0] for x in places for y in places])

    def error(camera: Camera, found: Pose, truth: Pose) -> tuple[float, np.ndarray]:
        difference = camera.project(found, grid) - camera.project(truth, grid)
        return float(np.sqrt(np.mean(np.sum(difference**2, axis=1)))), difference.mean(axis=0)

    return error
