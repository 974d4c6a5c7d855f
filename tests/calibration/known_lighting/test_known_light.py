"""Coefficients between whole frequencies, the mirror image, and the condition number."""

import numpy as np
import pytest

from arlight.calibration.known_lighting.checks import condition_number, order_errors
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.camera import Pose
from arlight.environment import Environment
from arlight.fourier import half_plane_frequencies, unpack_real
from arlight.optics import Slab
from arlight.probe.layout import design_probe


def spotty(seed):
    radiance = np.random.default_rng(seed).gamma(0.3, 1.0, (32, 64, 3)).astype(np.float32)
    return Environment(radiance, yaw_rad=0.4)


@pytest.mark.parametrize("scale", [1.0, 0.97, 1.043])
@pytest.mark.parametrize("index", [1.52, 1.49])
def test_coefficients_are_the_environments_own(scale, index):
    environment = spotty(3)
    frequencies = scale * half_plane_frequencies(5)
    found = unpack_real(KnownLight("spots", environment, index).packed(frequencies))
    true = environment.coefficients(Slab(refractive_index=index), frequencies)
    np.testing.assert_allclose(found, true, atol=3e-4 * np.abs(true[0]).max())


def test_asking_again_or_changing_the_answer_changes_nothing():
    light = KnownLight("spots", spotty(4), 1.52)
    frequencies = half_plane_frequencies(2)
    first = light.packed(frequencies)
    kept = first.copy()
    first[:] = 0.0
    for scale in np.linspace(0.9, 1.1, 40):
        light.packed(scale * frequencies)
    np.testing.assert_array_equal(light.packed(frequencies), kept)


def test_an_even_sky_is_mirrored_as_fresnel_has_it():
    light = KnownLight("even", Environment(np.full((16, 32, 3), 2.0, np.float32)), 1.52)
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))
    found = light.mirrored(pose, np.array([[0.0, 0.0]]), np.array([1.0]), Slab())
    np.testing.assert_allclose(found, 2.0 * ((1.52 - 1) / (1.52 + 1)) ** 2, rtol=1e-3)


def test_what_is_mirrored_lies_opposite_to_the_camera():
    radiance = np.zeros((64, 128, 3), np.float32)
    # a lamp at azimuth 90 degrees, 40 degrees off the normal
    radiance[int(40 / 180 * 64), 32] = 500.0
    light = KnownLight("lamp", Environment(radiance), 1.52)
    tilt = np.deg2rad(40.0)
    centers, half = np.array([[0.0, 0.0]]), np.array([8.0])

    def seen(azimuth_deg):
        azimuth = np.deg2rad(azimuth_deg)
        toward = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        pose = Pose(np.stack([right, np.cross(-toward, right), -toward]), np.array([0.0, 0.0, 300.0]))
        return light.mirrored(pose, centers, half, Slab())[0, 1]

    assert seen(-90.0) > 1.0
    assert max(seen(90.0), seen(0.0), seen(180.0)) < 1e-6


def test_condition_tells_mixtures_and_brightness_apart():
    probe = design_probe(order=2)
    first, second = (KnownLight(str(seed), spotty(seed), 1.52) for seed in (1, 2))
    mixed = Environment(0.5 * first.environment.radiance + 0.5 * second.environment.radiance, 0.4)
    condition, spread = condition_number([first, second], probe)
    assert 1.0 < condition < 1e3
    assert 0.0 < spread < 1.0
    assert condition_number([first, second, KnownLight("mixed", mixed, 1.52)], probe)[0] > 1e6
    bright = KnownLight("bright", first.environment.scaled(3.0), 1.52)
    assert condition_number([bright, second], probe)[0] == pytest.approx(condition, rel=1e-5)


def test_errors_are_stated_relative_to_the_first_coefficient():
    frequencies = half_plane_frequencies(2)
    truth = np.zeros((len(frequencies), 3), complex)
    truth[0] = 2.0
    found = truth.copy()
    found[0] += 0.02
    found[1:3] += 0.06j
    np.testing.assert_allclose(order_errors(found, truth, frequencies), [0.01, 0.03, 0.0], atol=1e-12)
