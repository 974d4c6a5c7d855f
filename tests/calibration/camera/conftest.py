"""A small sheet and flat prints, photographed by ray casting through Brown's lens written out: no OpenCV's optics."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.color import encoded_from_linear
from arlight.probe import patterns
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe

SIZE = (640, 480)
FOCAL_PX = 560.0
LENS = (0.06, -0.12, 0.0005, -0.0004, 0.03)


@dataclass(frozen=True)
class Print:
    """A flat print in the plane z = 0, centred, row 0 at the top."""

    reflectance: np.ndarray
    texels_per_mm: float
    beyond: float = 0.25


@pytest.fixture(scope="session")
def lens_camera() -> Camera:
    """Off-centre, with some distortion."""
    matrix = np.array([[FOCAL_PX, 0, 322.0], [0, FOCAL_PX, 238.0], [0, 0, 1]])
    return Camera(SIZE, matrix, np.array(LENS))


@pytest.fixture(scope="session")
def small_sheet() -> Probe:
    """An order-1 sheet."""
    return design_probe(order=1, pixels_per_mm=10.0)


@pytest.fixture(scope="session")
def sheet_print(small_sheet: Probe) -> Print:
    """Its frame around a field of waves."""
    frame, window = patterns.frame(small_sheet)
    rows, columns = np.indices(frame.shape)
    waves = 0.35 + 0.3 * np.sin(rows / 7.0) * np.cos(columns / 9.0)
    return Print(
        np.where(window, waves, frame * small_sheet.paper_reflectance).astype(np.float32), small_sheet.pixels_per_mm
    )


def brown(x: np.ndarray, y: np.ndarray, lens: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distorted normalised coordinates."""
    k1, k2, p1, p2, k3 = lens
    r = x**2 + y**2
    radial = 1 + k1 * r + k2 * r**2 + k3 * r**3
    return (
        x * radial + 2 * p1 * x * y + p2 * (r + 2 * x**2),
        y * radial + p1 * (r + 2 * y**2) + 2 * p2 * x * y,
    )


@pytest.fixture(scope="session")
def project() -> Callable[..., np.ndarray]:
    """Pixels of points of the plane z = 0, by hand."""

    def pixels(camera: Camera, pose: Pose, points_mm: np.ndarray) -> np.ndarray:
        seen = np.column_stack([points_mm, np.zeros(len(points_mm))]) @ pose.rotation.T + pose.translation
        x, y = brown(seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2], camera.distortion)
        k = camera.camera_matrix
        return np.stack([k[0, 0] * x + k[0, 2], k[1, 1] * y + k[1, 2]], axis=1)

    return pixels


def _ray_grid(camera: Camera, across: int) -> tuple[np.ndarray, np.ndarray]:
    """Undistorted coordinates of a fine grid of places in every pixel, by fixed-point iteration."""
    width, height = camera.image_size
    offsets = (np.arange(across) + 0.5) / across - 0.5
    u, v = np.meshgrid((np.arange(width)[:, None] + offsets).ravel(), (np.arange(height)[:, None] + offsets).ravel())
    # sheared: an edge along rows or columns then meets across^2 different places, not across
    row, column = np.tile(offsets, height)[:, None], np.tile(offsets, width)
    u, v = u + row / across, v - column / across
    k = camera.camera_matrix
    wanted_x, wanted_y = (u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1]
    x, y = wanted_x, wanted_y
    for _ in range(12):
        found_x, found_y = brown(x, y, camera.distortion)
        x, y = x + wanted_x - found_x, y + wanted_y - found_y
    return x.astype(np.float32), y.astype(np.float32)


@pytest.fixture(scope="session")
def photograph() -> Callable[..., np.ndarray]:
    """(h, w, 3) uint8 picture of a print: rays averaged in linear light, lens blur, noise, a response curve.

    light: (3,) or a function of (x, y) [mm] that gives (..., 3); curve: encoded values of linear light.
    """
    grids: dict[tuple, tuple[np.ndarray, np.ndarray]] = {}

    def take(
        print_,
        camera,
        pose,
        light=(1.0, 1.0, 1.0),
        curve=encoded_from_linear,
        blur_px=0.6,
        noise=0.002,
        seed=0,
        across=3,
    ):
        key = (camera.image_size, camera.camera_matrix.tobytes(), camera.distortion.tobytes(), across)
        if key not in grids:
            grids[key] = _ray_grid(camera, across)
        x, y = grids[key]
        centre = (-pose.rotation.T @ pose.translation).astype(np.float32)
        turn = pose.rotation.astype(np.float32)
        toward = [turn[0, k] * x + turn[1, k] * y + turn[2, k] for k in range(3)]
        reach = -centre[2] / np.minimum(toward[2], -1e-9)
        on_x, on_y = centre[0] + reach * toward[0], centre[1] + reach * toward[1]
        rows, columns = print_.reflectance.shape
        # in single precision, where a texel is still a thousand steps wide
        column = np.floor(on_x * print_.texels_per_mm + columns / 2.0).astype(int)
        row = np.floor(rows / 2.0 - on_y * print_.texels_per_mm).astype(int)
        on = (toward[2] < 0) & (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
        value = np.where(on, print_.reflectance[row.clip(0, rows - 1), column.clip(0, columns - 1)], print_.beyond)
        grey = _binned(value, across)
        falling = light(_binned(on_x, across), _binned(on_y, across)) if callable(light) else np.array(light)
        linear = grey[..., None] * falling
        linear = cv2.GaussianBlur(linear, (0, 0), blur_px) if blur_px > 0 else linear
        linear = linear + noise * np.random.default_rng(seed).normal(size=linear.shape)
        return np.rint(np.clip(curve(np.clip(linear, 0.0, 1.0)), 0.0, 1.0) * 255.0).astype(np.uint8)

    return take


def _binned(fine: np.ndarray, across: int) -> np.ndarray:
    rows, columns = fine.shape
    return fine.reshape(rows // across, across, columns // across, across).mean(axis=(1, 3))
