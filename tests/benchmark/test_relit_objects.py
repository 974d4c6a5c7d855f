"""Objects under maps of radiance: what even light and single lamps must look like."""

import numpy as np
import pytest

from arlight.benchmark.relit_objects import MATERIALS, RelitObjects
from arlight.calibration.ball.mirror_ball import MapGrid

GRID = MapGrid(32)


@pytest.fixture(scope="module")
def objects() -> RelitObjects:
    return RelitObjects(GRID, points=60)


def test_even_light_is_reflected_evenly(objects):
    even = np.full((32, 64, 3), 0.25, np.float32)
    for material, light in zip(MATERIALS, objects.appearance(even), strict=True):
        expected = 0.25 * np.pi if material.roughness is None else 0.25
        np.testing.assert_allclose(light, expected, rtol=5e-3)


def test_the_right_light_has_no_error_and_half_the_light_half(objects):
    light = np.random.default_rng(0).uniform(0.1, 0.4, (32, 64, 3)).astype(np.float32)
    np.testing.assert_allclose(objects.errors(light, light), 0.0, atol=1e-12)
    np.testing.assert_allclose(objects.errors(0.5 * light, light), 0.5, rtol=1e-5)


def test_smoother_surfaces_tell_more_about_a_lamp_that_is_misplaced(objects):
    lamp, moved = np.full((2, 32, 64, 3), 0.01, np.float32)
    lamp[8, 20], moved[8, 22] = 3.0, 3.0
    errors = objects.errors(moved, lamp)[:3]
    assert np.all(np.diff(errors) > 0.0)


def test_a_screen_shows_nothing_above_white(objects):
    dim, bright = np.full((2, 32, 64, 3), 0.2, np.float32)
    dim[:16], bright[:16] = 2.0, 50.0
    errors = dict(zip([material.name for material in MATERIALS], objects.errors(dim, bright), strict=True))
    assert errors["mirror, on screen"] == 0.0
    assert errors["mirror-like"] > 0.9
