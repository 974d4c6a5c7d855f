"""The matte ball's inverse: light that nine harmonics can hold comes back from its shading."""

import numpy as np
import pytest

from arlight.benchmark.ball_scene import Ball, SurroundingLight, with_ball
from arlight.benchmark.matte_ball import harmonics, matte_ball_light
from arlight.calibration.ball.ball_outline import BallOutline
from arlight.calibration.ball.mirror_ball import BallPicture, MapGrid
from arlight.camera import Camera, Pose
from arlight.environment import Environment

CAMERA = Camera((240, 200), np.array([[400.0, 0, 119.5], [0, 400.0, 99.5], [0, 0, 1]]), np.zeros(5))
POSE = Pose.from_rvec([2.4, 0.2, 0.1], [0.0, 0.0, 300.0])


def test_harmonics_are_orthonormal():
    grid = MapGrid(64)
    basis = harmonics(grid.directions().reshape(-1, 3))
    weight = np.broadcast_to(grid.solid_angle_sr, (64, 128)).ravel()
    np.testing.assert_allclose(basis.T @ (weight[:, None] * basis), np.eye(9), atol=2e-3)


def test_smooth_light_comes_back():
    grid = MapGrid(64)
    coefficients = np.array([3.0, 0.4, 0.5, -0.6, 0.2, -0.1, 0.3, 0.2, -0.2])[:, None] * np.array([1.0, 0.8, 0.6])
    sky = (harmonics(grid.directions().reshape(-1, 3)) @ coefficients).reshape(64, 128, 3)
    light = SurroundingLight(Environment(sky.astype(np.float32)), (0.0, 0.0, 0.0))
    ball = Ball((0.0, 0.0, 0.0), 40.0, "matte", 0.5)
    # the whole sphere shines: what is below the horizon must be counted with it
    normals = harmonics(grid.directions().reshape(-1, 3))
    cosine = np.array([np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5)
    irradiance = (normals @ (cosine[:, None] * coefficients)).reshape(64, 128, 3)
    light.__dict__["irradiance_map"] = Environment(irradiance.astype(np.float32))
    picture = with_ball(np.zeros((200, 240, 3), np.float32), CAMERA, POSE, ball, light, (10.0, 10.0))
    center = POSE.transform(np.zeros(3))
    distance = np.linalg.norm(center)
    outline = BallOutline(center / distance, float(np.arcsin(40.0 / distance)))
    taken = BallPicture(picture, np.zeros((200, 240), bool), CAMERA, POSE, outline)
    found = matte_ball_light(taken, 0.5)
    assert found == pytest.approx(coefficients, abs=0.02)
