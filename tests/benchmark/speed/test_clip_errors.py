"""Errors of pose, coefficients and lit pictures on made-up estimates."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.benchmark.speed.clip_errors import (
    coefficient_errors,
    light_error,
    need_error,
    pose_errors_px,
    relative_rms,
    rms,
    true_lighting,
)
from arlight.benchmark.speed.relighters import Relighters
from arlight.camera import Pose
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need
from arlight.fourier import pack_real
from arlight.rendering.settings import RelightSettings


@pytest.fixture
def true_light(clip):
    count = 2 * len(clip.probe.frequencies) - 1
    truth = clip.truth[0]
    return Lighting(clip.probe.frequencies, truth.coefficients, np.zeros((3, count, count)), 0.0, 1.0)


def test_a_pose_that_is_right_has_no_error_and_none_has_nan(clip):
    errors = pose_errors_px([clip.truth[0].pose, None], clip.truth[:2], clip.camera, clip.probe)
    assert errors[0] == 0.0
    assert np.isnan(errors[1])


def test_a_shift_across_the_picture_moves_all_corners_by_it(clip):
    true = clip.truth[0].pose
    sideways_mm = 0.5
    shifted = Pose(true.rotation, true.translation + [sideways_mm, 0.0, 0.0])
    (error,) = pose_errors_px([shifted], clip.truth[:1], clip.camera, clip.probe)
    focal_px = clip.camera.camera_matrix[0, 0]
    depths = true.transform(clip.probe.outline_mm)[:, 2]
    assert error == pytest.approx(np.sqrt(np.mean((focal_px * sideways_mm / depths) ** 2)), rel=0.03)


def test_rms_leaves_out_what_was_not_found_and_nothing_at_all_is_infinitely_wrong():
    assert rms(np.array([3.0, np.nan, 4.0])) == pytest.approx(np.sqrt(12.5))
    assert rms(np.array([np.nan, np.nan])) == np.inf


def test_coefficients_by_order(clip, true_light):
    spoiled = true_light.coefficients.copy()
    level = np.sqrt(np.mean(np.abs(spoiled[0]) ** 2))
    spoiled[1:] += 0.1j * level
    errors = coefficient_errors([replace(true_light, coefficients=spoiled)], clip.truth[:1], clip.probe)
    assert errors.orders == pytest.approx((0.0, 0.1))
    assert errors.together == pytest.approx(0.1)


def test_what_a_light_does_not_reach_counts_as_dark(clip, true_light):
    cut = true_light.truncated(0)
    size = np.sqrt(np.mean(np.abs(true_light.coefficients[1:]) ** 2))
    level = np.sqrt(np.mean(np.abs(true_light.coefficients[0]) ** 2))
    assert coefficient_errors([cut], clip.truth[:1], clip.probe).orders == pytest.approx((0.0, size / level))


def test_no_light_is_infinitely_wrong(clip):
    assert coefficient_errors([None], clip.truth[:1], clip.probe).together == np.inf


def test_the_object_shows_how_much_too_bright_the_light_is(clip, true_light):
    relighters = Relighters()
    try:
        relighter = relighters.of(clip.probe, clip.camera, RelightSettings(directions=64, shadow_texels=32))
        pose = clip.truth[0].pose
        true = true_lighting(true_light, clip.truth[0], clip.probe)
        assert light_error(relighter, true_light, true, pose) == 0.0
        brighter = true_light.scaled(np.full(3, 1.2))
        assert light_error(relighter, brighter, true, pose) == pytest.approx(0.2, rel=0.01)
        behind = Pose(pose.rotation, pose.translation - [0.0, 0.0, 1e4])
        assert np.isnan(light_error(relighter, true_light, true, behind))
    finally:
        relighters.release()


def test_the_object_s_need_shows_how_wrong_the_light_is(clip, true_light):
    count = 2 * len(clip.probe.frequencies) - 1
    triangle = np.tril(np.random.default_rng(3).uniform(0.5, 1.0, (count, count)))
    to_parts = np.linalg.inv(triangle)
    need = Need(triangle, to_parts.T @ to_parts, 0.04)
    true = clip.truth[0]
    light = replace(true_light, coefficients=true.coefficients)
    assert need_error(need, light, true) == pytest.approx(0.0, abs=1e-12)
    assert need_error(need, light.scaled(np.full(3, 1.2)), true) == pytest.approx(0.2)
    # parts that are left out are missing, the others are right
    parts = to_parts @ pack_real(true.coefficients)
    missing = np.sum(parts[1:] ** 2) / np.sum(parts**2)
    assert need_error(need, light.truncated(0), true) == pytest.approx(np.sqrt(missing))


def test_relative_rms_of_nothing_is_not_told():
    assert np.isnan(relative_rms(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)))
    assert np.isnan(relative_rms(np.ones((2, 3), np.float32), np.zeros((2, 3), np.float32)))
    assert relative_rms(np.full((4, 3), 1.5, np.float32), np.ones((4, 3), np.float32)) == pytest.approx(0.5)
