"""What a picture shows of light: laws of its errors and of its parts."""

import numpy as np
import pytest

from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need, ShownLight
from arlight.fourier import frequency_order, half_plane_frequencies, pack_real, unpack_real

FREQUENCIES = half_plane_frequencies(3)
PACKED_ORDERS = np.repeat(frequency_order(FREQUENCIES), 2)[1:]
COUNT = len(PACKED_ORDERS)


@pytest.fixture
def need() -> Need:
    """Correlated coefficients and an object that shows all of them, some together."""
    chance = np.random.default_rng(1)
    independent = np.tril(0.1 * chance.standard_normal((COUNT, COUNT))) + np.diag(1.0 / (1.0 + PACKED_ORDERS))
    mixed = chance.standard_normal((COUNT, COUNT))
    return Need(independent, mixed @ mixed.T, 0.04)


@pytest.fixture
def shown(need: Need) -> ShownLight:
    return ShownLight(FREQUENCIES, need)


def lighting(stddev: float, scale: float = 1.0, seed: int = 2) -> Lighting:
    packed = 0.1 * np.random.default_rng(seed).standard_normal((COUNT, 3))
    packed[0] = 1.0
    covariance = np.tile(stddev**2 * np.eye(COUNT), (3, 1, 1))
    return Lighting(FREQUENCIES, unpack_real(scale * packed), scale**2 * covariance, 0.0, 1.0)


def test_what_is_known_for_certain_is_wrong_only_by_what_is_left_out(shown: ShownLight) -> None:
    certain = lighting(1e-6)
    assert shown.squared_errors(certain) == pytest.approx(shown.beyond(certain), rel=1e-3, abs=1e-4)
    assert shown.beyond(certain)[-1] == 0.0
    assert np.all(shown.beyond(certain)[:-1] > 0.0)


def test_uncertainty_makes_every_order_worse(shown: ShownLight) -> None:
    assert shown.squared_errors(lighting(0.05))[-1] > shown.squared_errors(lighting(0.005))[-1]
    assert shown.chance_beyond(lighting(0.2), 1) == pytest.approx(4.0 * shown.chance_beyond(lighting(0.1), 1), rel=1e-3)


def test_a_brighter_light_is_no_other_one(shown: ShownLight) -> None:
    faint, bright = lighting(0.02), lighting(0.02, scale=7.0)
    assert shown.strength(bright) == pytest.approx(shown.strength(faint), rel=1e-4)
    shown.reset()
    first = shown.squared_errors(faint)
    shown.reset()
    assert shown.squared_errors(bright) == pytest.approx(first, rel=1e-3)


def test_orders_come_in_proportion_and_leave_the_lower_ones_alone(shown: ShownLight, need: Need) -> None:
    light = lighting(0.01)
    whole, half, none = (pack_real(shown.in_part(light, 1, share).coefficients) for share in (1.0, 0.5, 0.0))
    lower = PACKED_ORDERS <= 1
    assert np.array_equal(whole, pack_real(light.coefficients))
    assert np.allclose(half, 0.5 * (whole + none))
    assert np.allclose(none[lower], whole[lower])
    # what is left of the higher ones is what the lower ones make probable
    assert np.allclose(np.linalg.solve(need.independent, none)[~lower], 0.0, atol=1e-9)
