"""Softened environments keep their power, and their coefficients are those of what a renderer reads."""

import numpy as np
import pytest

from arlight.environment import Environment
from arlight.errors import OutputError
from arlight.optics import Slab
from arlight.validation.soft_light import as_stored, received_coefficients, save_environment, softened


def power(environment):
    rows, columns = environment.radiance.shape[:2]
    theta = np.arange(rows + 1) * np.pi / rows
    area = (np.cos(theta[:-1]) - np.cos(theta[1:])) * 2 * np.pi / columns
    return np.einsum("r,rck->k", area, environment.radiance.astype(float))


def lamp(row, column, rows=32):
    radiance = np.zeros((rows, 2 * rows, 3), np.float32)
    radiance[row, column] = [50.0, 20.0, 10.0]
    return Environment(radiance)


@pytest.mark.parametrize("row", [0, 7, 15, 16, 31])
def test_softening_keeps_the_power_of_a_lamp_anywhere(row):
    sharp = lamp(row, 5)
    np.testing.assert_allclose(power(softened(sharp, 6.0, 32)), power(sharp), rtol=2e-3)


def test_an_even_light_stays_even():
    even = Environment(np.full((64, 128, 3), 0.7, np.float32))
    np.testing.assert_allclose(softened(even, 6.0, 64).radiance, 0.7, rtol=5e-3)


def test_a_lamp_spreads_by_the_angle_asked_for():
    spread = np.deg2rad(8.0)
    soft = softened(lamp(7, 10, 32), 8.0, 64)
    directions, light = soft.samples()
    theta, phi = np.pi * 7.5 / 32, 2 * np.pi * 10.5 / 64
    centre = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    angle = np.arccos(np.clip(directions @ centre, -1, 1))
    near = angle < np.deg2rad(30)
    # two angles, each with the variance asked for
    variance = np.sum(light[near, 0] * angle[near] ** 2) / np.sum(light[near, 0])
    assert np.sqrt(variance / 2) == pytest.approx(spread, rel=0.02)


def test_fine_integral_agrees_with_the_maps_own_sum_for_a_smooth_light(smooth_light):
    slab = Slab()
    frequencies = [(0, 0), (1, 0), (-1, 2), (0, 5)]
    fine = received_coefficients(smooth_light, slab, frequencies)
    # the map has only 16 rows: its own sum is good to a percent
    coarse = smooth_light.coefficients(slab, frequencies)
    assert np.abs(fine - coarse).max() < 0.012 * np.abs(fine[0]).max()


def test_a_white_sky_gives_the_slabs_diffuse_transmittance():
    sky = Environment(np.ones((8, 16, 3), np.float32))
    cosine = (np.arange(20000) + 0.5) / 20000
    expected = np.pi * np.mean(2 * cosine * Slab().transmittance(cosine))
    np.testing.assert_allclose(received_coefficients(sky, Slab(), [(0, 0)])[0].real, expected, rtol=1e-5)


def test_a_stored_map_comes_back_to_the_formats_precision(tmp_path, smooth_light):
    stored = as_stored(smooth_light, tmp_path / "light.hdr")
    largest = smooth_light.radiance.max(axis=2, keepdims=True)
    assert np.all(np.abs(stored.radiance - smooth_light.radiance) <= largest / 128)


def test_a_folder_that_is_not_there_is_named(tmp_path, smooth_light):
    with pytest.raises(OutputError, match="missing"):
        save_environment(smooth_light, tmp_path / "missing" / "light.hdr")
