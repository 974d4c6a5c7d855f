"""The strongest light's direction, read off coefficients."""

import numpy as np
import pytest

from arlight.benchmark.light_direction import strongest_light
from arlight.fourier import analyse, half_plane_frequencies
from arlight.optics import Slab

SLAB = Slab()


def lamp(elevation_deg: float, azimuth_deg: float) -> np.ndarray:
    polar, azimuth = np.radians(90.0 - elevation_deg), np.radians(azimuth_deg)
    return np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def found(directions: np.ndarray, light: np.ndarray, order: int) -> np.ndarray:
    frequencies = half_plane_frequencies(order)
    return strongest_light(analyse(light, SLAB.light_plane(directions), frequencies), frequencies, SLAB)


@pytest.mark.parametrize(("order", "elevation_deg"), [(2, 88.0), (3, 75.0), (5, 88.0), (5, 60.0)])
@pytest.mark.parametrize("azimuth_deg", [0.0, 77.0, 201.0])
def test_one_lamp_is_found(order, azimuth_deg, elevation_deg):
    # the lobe of a point is symmetric about the point; the disk's rim does not cut these
    direction = lamp(elevation_deg, azimuth_deg)
    error = np.linalg.norm(found(direction[None], np.array([[2.0, 1.0, 0.5]]), order) - direction)
    assert np.degrees(error) < 0.25


@pytest.mark.parametrize("order", [1, 3])
def test_a_quarter_turn_of_the_light_is_a_quarter_turn_of_its_direction(order):
    rng = np.random.default_rng(6)
    directions = np.stack([lamp(e, a) for e, a in zip(rng.uniform(20, 90, 6), rng.uniform(0, 360, 6), strict=True)])
    light = rng.uniform(0.1, 1.0, (6, 3))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(
        found(directions @ turn.T, light, order), turn @ found(directions, light, order), atol=1e-9
    )


def test_the_brighter_of_two_lamps_is_found():
    directions = np.stack([lamp(60.0, 10.0), lamp(50.0, 190.0)])
    light = np.array([[1.0, 1.0, 1.0], [1.5, 1.5, 1.5]])
    # side lobes of the first pull the second a little
    assert np.degrees(np.linalg.norm(found(directions, light, 5) - directions[1])) < 3.0
    assert np.degrees(np.linalg.norm(found(directions, light[::-1], 5) - directions[0])) < 3.0


def test_uniform_light_comes_from_above_and_darkness_from_the_zenith():
    frequencies = half_plane_frequencies(2)
    for level in (0.0, 1.0):
        coefficients = np.zeros((len(frequencies), 3), complex)
        coefficients[0] = level
        np.testing.assert_allclose(strongest_light(coefficients, frequencies, SLAB), [0.0, 0.0, 1.0], atol=1e-9)
