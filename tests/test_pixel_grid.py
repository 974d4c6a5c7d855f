"""Smooth functions over a picture, against the function itself at every pixel."""

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.pixel_grid import over_pixels

LENSES = {
    "barrel": [-0.3, 0.1, 0.001, -0.001, 0.0],
    "pincushion": [0.3, -0.5, 0.0, 0.0, 0.2],
    "tangential": [0.0, 0.0, 0.01, -0.008, 0.0],
    "rational": [5.0, 2.0, 0.0, 0.0, 0.1, 5.5, 3.5, 0.5],
    "none": [],
}


def pixels_of(size):
    x, y = np.meshgrid(np.arange(size[0], dtype=float), np.arange(size[1], dtype=float))
    return np.stack([x, y], axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("size", [(1, 1), (7, 3), (128, 2), (333, 517)])
def test_cubics_come_out_exactly(size):
    def cubic(at):
        x, y = at.T / max(size)
        return np.stack([x**3 - 2.0 * x * y**2 + 0.3, (1.0 - x) ** 2 * y**3], axis=-1)

    exact = cubic(pixels_of(size)).reshape(size[1], size[0], 2)
    np.testing.assert_allclose(over_pixels(cubic, size), exact, atol=2e-7)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("size", [(640, 480), (1280, 720), (200, 640)])
def test_rays_of_lenses_are_off_by_less_than_a_thousandth_of_a_pixel(lens, size):
    focal = 0.75 * max(size)
    matrix = np.array([[focal, 0.0, 0.51 * size[0]], [0.0, focal, 0.48 * size[1]], [0.0, 0.0, 1.0]])
    camera = Camera(size, matrix, np.array(LENSES[lens]))
    chosen = np.random.default_rng(0).permutation(size[0] * size[1])[:20000]
    exact = camera.rays(pixels_of(size)[chosen])
    found = over_pixels(camera.rays, size).reshape(-1, 2)[chosen]
    assert focal * np.abs(found - exact).max() < 1e-3


def test_reads_the_function_at_few_places():
    seen = []

    def counted(at):
        seen.append(len(at))
        return at[:, :1]

    over_pixels(counted, (1920, 1080))
    assert sum(seen) < 1920 * 1080 / 100
