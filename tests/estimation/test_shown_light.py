"""What a picture shows of light: laws of its errors and of its parts."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.drawn_light import DrawnLight
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need, ShownLight
from arlight.fourier import frequency_order, half_plane_frequencies, pack_real, unpack_real
from tests.estimation.conftest import Anywhere

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
    return ShownLight(Anywhere(FREQUENCIES, need.independent), need)


def lighting(stddev: float, scale: float = 1.0, seed: int = 2) -> Lighting:
    packed = 0.1 * np.random.default_rng(seed).standard_normal((COUNT, 3))
    packed[0] = 1.0
    covariance = np.tile(stddev**2 * np.eye(COUNT), (3, 1, 1))
    return Lighting(FREQUENCIES, unpack_real(scale * packed), scale**2 * covariance, 0.0, 1.0)


def test_what_is_known_for_certain_is_wrong_only_by_what_is_left_out(shown: ShownLight) -> None:
    certain = lighting(1e-6)
    shown.take_in(certain)
    assert shown.squared_errors(certain) == pytest.approx(shown.beyond(certain), rel=1e-3, abs=1e-4)
    assert shown.beyond(certain)[-1] == 0.0
    assert np.all(shown.beyond(certain)[:-1] > 0.0)


def test_uncertainty_makes_every_order_worse(shown: ShownLight) -> None:
    assert shown.squared_errors(lighting(0.05))[-1] > shown.squared_errors(lighting(0.005))[-1]
    assert shown.chance_beyond(lighting(0.2), 1) == pytest.approx(4.0 * shown.chance_beyond(lighting(0.1), 1), rel=1e-3)


def test_a_brighter_light_is_no_other_one(shown: ShownLight) -> None:
    faint, bright = lighting(0.02), lighting(0.02, scale=7.0)
    assert shown.strength(bright, bright.order) == pytest.approx(shown.strength(faint, faint.order), rel=1e-4)
    shown.take_in(faint)
    first = shown.squared_errors(faint)
    shown.reset()
    shown.take_in(bright)
    assert shown.squared_errors(bright) == pytest.approx(first, rel=1e-3)


def test_what_is_known_for_certain_is_drawn_as_it_is(shown: ShownLight) -> None:
    light, drawn = lighting(1e-6), DrawnLight(COUNT)
    shown.take_in(light)
    drawn.pass_to(shown.weights(light, 3))
    assert np.allclose(shown.drawn(light, drawn).coefficients, light.coefficients, atol=1e-6)


def test_the_less_is_known_the_less_is_drawn_but_never_less_of_the_level(shown: ShownLight) -> None:
    light = lighting(0.01)
    shown.take_in(light)
    powers = []
    for stddev in (0.01, 0.1, 1.0, 10.0):
        weights = shown.weights(replace(light, covariance=np.tile(stddev**2 * np.eye(COUNT), (3, 1, 1))), 3)
        assert weights[0, 0] == pytest.approx(1.0, rel=1e-6)
        powers.append(np.linalg.eigvals(weights[1:, 1:]).real)
        assert np.all((powers[-1] > 0.0) & (powers[-1] < 1.0 + 1e-6))
    assert np.all(np.diff([power.sum() for power in powers]) < 0.0)


def test_what_is_not_drawn_is_what_the_rest_makes_probable(shown: ShownLight, need: Need) -> None:
    light, drawn = lighting(1e-6), DrawnLight(COUNT)
    shown.take_in(light)
    drawn.pass_to(shown.weights(light, 1))
    packed = pack_real(shown.drawn(light, drawn).coefficients)
    lower = PACKED_ORDERS <= 1
    assert np.allclose(packed[lower], pack_real(light.coefficients)[lower], atol=1e-5)
    assert np.allclose(np.linalg.solve(need.independent, packed)[~lower], 0.0, atol=1e-9)
