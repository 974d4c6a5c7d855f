"""Traced balls: laws that hold for every ball, under light whose reflection is known without tracing."""

import numpy as np
import pytest

from arlight.benchmark.ball_scene import Ball, SurroundingLight, with_ball
from arlight.camera import Camera, Pose
from arlight.environment import Environment

CAMERA = Camera((160, 120), np.array([[200.0, 0, 79.5], [0, 200.0, 59.5], [0, 0, 1]]), np.zeros(5))
POSE = Pose.from_rvec([2.5, 0.0, 0.0], [0.0, 0.0, 300.0])
SHEET_MM = (20.0, 20.0)
EVEN = Environment(np.full((32, 64, 3), 0.4, np.float32))


def ball(finish, reflectance=0.6, radius=40.0) -> Ball:
    return Ball((0.0, 0.0, radius), radius, finish, reflectance)


def test_a_mirror_shows_its_reflectance_of_even_light():
    light = SurroundingLight(EVEN, (1.0, 1.0, 1.0))
    # a white table under even light is as bright as the sky
    np.testing.assert_allclose(light.ground_radiance, 0.4, rtol=2e-3)
    picture = with_ball(np.zeros((120, 160, 3), np.float32), CAMERA, POSE, ball("mirror"), light, SHEET_MM)
    center = CAMERA.project(POSE, [[0.0, 0.0, 40.0]])[0].astype(int)
    upper = picture[center[1] - 20, center[0]]
    np.testing.assert_allclose(upper, 0.24, rtol=2e-3)


def test_a_matte_ball_is_evenly_lit_by_even_light():
    light = SurroundingLight(EVEN, (1.0, 1.0, 1.0))
    picture = with_ball(np.zeros((120, 160, 3), np.float32), CAMERA, POSE, ball("matte"), light, SHEET_MM)
    x, y = CAMERA.project(POSE, [[0.0, 0.0, 40.0]])[0].astype(int)
    np.testing.assert_allclose(picture[y - 15 : y + 15, x - 15 : x + 15], 0.24, rtol=5e-3)


def test_the_table_is_dark_at_the_foot_and_open_far_away():
    stand = ball("mirror")
    table = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [4000.0, 0.0, 0.0]])
    openness = stand.openness(table)[:, 0]
    assert openness[0] == pytest.approx(0.0, abs=1e-12)
    # solid angle of a hemisphere's worth of directions, counted by brute force
    generator = np.random.default_rng(0)
    radius, turn = np.sqrt(generator.uniform(size=200000)), generator.uniform(0, 2 * np.pi, 200000)
    w = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)], axis=1)
    along = w @ (np.array(stand.center_mm) - table[1])
    blocked = (along > 0) & (np.sum((np.array(stand.center_mm) - table[1]) ** 2) - along**2 < stand.radius_mm**2)
    # 200000 cosine-distributed rays: standard deviation 0.001
    assert openness[1] == pytest.approx(1.0 - blocked.mean(), abs=0.004)
    assert openness[2] > 0.9999


def test_the_sheet_keeps_its_light():
    light = SurroundingLight(EVEN, (0.3, 0.3, 0.3))
    aside = Ball((70.0, 0.0, 20.0), 20.0, "mirror", 0.6)
    before = np.full((120, 160, 3), 0.5, np.float32)
    after = with_ball(before, CAMERA, POSE, aside, light, SHEET_MM)
    x, y = np.rint(CAMERA.project(POSE, [[0.0, 0.0, 0.0]])[0]).astype(int)
    np.testing.assert_array_equal(after[y - 3 : y + 4, x - 3 : x + 4], 0.5)
