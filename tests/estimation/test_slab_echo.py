"""Light that goes back and forth in the glass, against rays followed one by one."""

import numpy as np
import pytest

from arlight.estimation.layer_series import HARMONICS, film_series
from arlight.estimation.slab_echo import echo_irradiance, uniform_light
from arlight.fourier import analyse, half_plane_frequencies, pack_real
from arlight.optics import Slab
from arlight.probe.assembly import Print
from arlight.probe.design import Block

SLAB = Slab(2.44, 1.52)
FREQUENCIES = half_plane_frequencies(5)
PSI = np.arange(16) * 2 * np.pi / 16


def smooth_sky(seed):
    """Directions with their received light: a bright band near the horizon on one side, and a dim rest."""
    generator = np.random.default_rng(seed)
    count = 60_000
    azimuth, z = generator.uniform(0, 2 * np.pi, count), generator.uniform(0, 1, count)
    sine = np.sqrt(1 - z**2)
    directions = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z], axis=1)
    toward = generator.uniform(0, 2 * np.pi)
    radiance = 0.3 + 3.0 * np.exp(2.0 * (np.cos(azimuth - toward) - 1.0)) * np.exp(-((z - 0.2) ** 2) / 0.08)
    return directions, radiance * 2 * np.pi / count


def followed(film, a, r):
    """Irradiance (psi,) through the film under a lamp of phase a, trip by trip, and as T counts it.

    Far crossings lie beyond the block, where the film has its mean and mean square.
    """
    all_phases = film(np.arange(64) * 2 * np.pi / 64)
    far, far_square = all_phases.mean(), (all_phases**2).mean()
    trips, through = (1 - r) ** 2 * film(PSI + a), (1 - r) ** 2 * film(PSI + a) ** 2 * far
    for _ in range(40):
        through = through * r**2
        trips = trips + through
        through = through * far_square
    return (1 - r) / (1 + r) * film(PSI + a), trips


@pytest.mark.parametrize("frequency", [(0, 0), (1, 0), (2, -1), (3, 4)])
@pytest.mark.parametrize("seed", range(2))
def test_echoes_are_the_round_trips(frequency, seed):
    directions, light = smooth_sky(seed)
    lit = slice(0, 4000)  # enough for the sum over rays, which is exact for its own directions
    directions, light = directions[lit], light[lit] * 15
    kind = "pattern" if any(frequency) else "clear_white"
    block = Block(0, kind, (0.0, 0.0), 12.0, 6.0, frequency if any(frequency) else None, 0.0)
    series = 0.95 * film_series((block,), "matched", Print(dot_gain=0.1), np.zeros((1, 2)))
    orders = np.arange(-HARMONICS, HARMONICS + 1)

    def film(psi):
        return (np.exp(1j * np.multiply.outer(psi, orders)) @ series[0]).real

    cosine = directions[:, 2]
    turn = 2 * np.pi * SLAB.light_plane(directions) @ np.array(frequency, float)
    face = SLAB.interface_reflectance(cosine)
    straight, trips = np.zeros(len(PSI)), np.zeros(len(PSI))
    for a, r, strength in zip(turn, face, light * cosine, strict=True):
        one = followed(film, a, r)
        straight += strength * one[0]
        trips += strength * one[1]
    received = light * cosine * SLAB.transmittance(cosine)
    packed = pack_real(analyse(received, SLAB.light_plane(directions), FREQUENCIES))
    kernel = echo_irradiance(series, np.array([frequency], float), SLAB, FREQUENCIES).irradiance[0]
    predicted = (np.exp(1j * np.multiply.outer(PSI, orders)) @ (kernel @ packed)).real
    change = trips - straight
    assert np.mean(change) < -0.002 * packed[0]
    # predicted from coefficients that do not resolve the horizon: most of the change, never more
    assert np.sqrt(np.mean((predicted - change) ** 2)) < 0.3 * np.sqrt(np.mean(change**2))


def test_a_uniform_sky_is_its_own_transform():
    packed = uniform_light(SLAB, FREQUENCIES)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (400_000, 2))
    points = points[np.hypot(*points.T) < 0.5]
    directions = SLAB.directions(points)
    weight = SLAB.projected_solid_angle_density(points) * SLAB.transmittance(directions[:, 2])
    true = pack_real(analyse(weight, points, FREQUENCIES)) / weight.sum()
    np.testing.assert_allclose(packed, true, atol=6e-3)


def test_no_echo_without_film():
    echo = echo_irradiance(np.zeros((1, 2 * HARMONICS + 1), complex), np.zeros((1, 2)), SLAB, FREQUENCIES)
    assert not np.any(echo.irradiance)
