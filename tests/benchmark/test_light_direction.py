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


@pytest.mark.parametrize("order", [1, 3, 5])
@pytest.mark.parametrize("azimuth_deg", [0.0, 77.0, 201.0])
@pytest.mark.parametrize("elevation_deg", [88.0, 60.0, 40.0])
def test_one_lamp_is_found_exactly(order, azimuth_deg, elevation_deg):
    # the synthesis of a point is a sum of cosines that all peak at the point
    frequencies = half_plane_frequencies(order)
    direction = lamp(elevation_deg, azimuth_deg)
    coefficients = analyse(np.array([[2.0, 1.0, 0.5]]), SLAB.light_plane(direction[None]), frequencies)
    found = strongest_light(coefficients, frequencies, SLAB)
    assert np.linalg.norm(found - direction) < 1e-6


def test_the_brighter_of_two_lamps_is_found():
    frequencies = half_plane_frequencies(5)
    directions = np.stack([lamp(60.0, 10.0), lamp(50.0, 190.0)])
    light = np.array([[1.0, 1.0, 1.0], [1.5, 1.5, 1.5]])
    coefficients = analyse(light, SLAB.light_plane(directions), frequencies)
    # side lobes of the first pull the second's peak by a little
    assert np.linalg.norm(strongest_light(coefficients, frequencies, SLAB) - directions[1]) < 0.05


def test_uniform_light_and_darkness_give_a_unit_vector():
    frequencies = half_plane_frequencies(2)
    for level in (0.0, 1.0):
        coefficients = np.zeros((len(frequencies), 3), complex)
        coefficients[0] = level
        assert np.linalg.norm(strongest_light(coefficients, frequencies, SLAB)) == pytest.approx(1.0)
