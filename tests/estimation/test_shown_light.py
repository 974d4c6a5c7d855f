"""What a picture shows of light: laws of its errors and of its parts."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.drawn_light import DrawnLight
from arlight.estimation.lighting import Lighting
from arlight.estimation.natural_light import NaturalLight
from arlight.estimation.shown_light import Need, ShownLight
from arlight.fourier import frequency_order, half_plane_frequencies, pack_real, unpack_real
from arlight.probe.layout import design_probe
from arlight.synthetic.captured import load_environment
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


SHEET = design_probe(order=4)
SHEET_ORDERS = np.repeat(frequency_order(SHEET.frequencies), 2)[1:]


@pytest.fixture(scope="module")
def natural() -> NaturalLight:
    return NaturalLight(SHEET.slab, SHEET.frequencies)


@pytest.fixture(scope="module")
def parts(natural: NaturalLight) -> np.ndarray:
    """Lower triangle of isotropic light, and a picture that shows all of its independent parts alike."""
    expected = natural.isotropic.expected
    return np.linalg.cholesky(natural.isotropic.covariance + np.outer(expected, expected))


def of_parts(triangle: np.ndarray) -> Need:
    to_parts = np.linalg.inv(triangle)
    return Need(triangle, to_parts.T @ to_parts, 0.04)


def picture_error(need: Need, light: Lighting, true: np.ndarray) -> float:
    """Squared, of a light whose left-out coefficients are drawn as the others make them most probable."""
    packed = pack_real(light.coefficients)
    n = len(packed)
    away = need.independent[:, :n] @ np.linalg.solve(need.independent[:n, :n], packed) - true
    return float(np.sum(away * (need.shown @ away))) / 3.0


def on_the_sheet(packed: np.ndarray, stddev: np.ndarray, seed: int) -> Lighting:
    """A light as it is measured with errors (m,) that its error bars tell."""
    seen = packed + stddev[:, None] * np.random.default_rng(seed).standard_normal((len(packed), 3))
    return Lighting(SHEET.frequencies, unpack_real(seen), np.tile(np.diag(stddev**2), (3, 1, 1)), 0.0, 1.0)


def test_knowing_where_light_comes_from_makes_pictures_truer(natural: NaturalLight, parts: np.ndarray) -> None:
    need, stddev = of_parts(parts), 0.03 * np.array([0.1, 1.0, 2.0, 4.0, 8.0])[SHEET_ORDERS]
    ratios = []
    for name in ("apartment", "bridge", "hall", "studio"):
        errors = np.zeros(2)
        for seed, yaw_rad in enumerate(np.arange(0.0, 2.0 * np.pi, 0.9)):
            true = pack_real(load_environment(name).rotated(yaw_rad).coefficients(SHEET.slab, SHEET.frequencies))
            light = on_the_sheet(true / true[0].mean(), stddev, seed)
            for k, prior in enumerate((Anywhere(SHEET.frequencies, parts), natural)):
                shown, drawn = ShownLight(prior, need), DrawnLight(len(true))
                shown.take_in(light)
                drawn.pass_to(shown.weights(light, 4))
                errors[k] += picture_error(need, shown.drawn(light, drawn), true / true[0].mean())
        ratios.append(np.sqrt(errors[1] / errors[0]))
    assert np.mean(ratios) < 0.9


def test_how_bright_light_is_makes_no_difference_to_where_it_comes_from(
    natural: NaturalLight, parts: np.ndarray
) -> None:
    true = pack_real(load_environment("hall").coefficients(SHEET.slab, SHEET.frequencies))
    light = on_the_sheet(true / true[0].mean(), 0.02 * SHEET_ORDERS, 1)
    weights = []
    for brightness in (1.0, 30.0):
        shown = ShownLight(natural, of_parts(parts))
        shown.take_in(light.scaled(np.full(3, brightness)))
        weights.append(shown.weights(light.scaled(np.full(3, brightness)), 4))
    np.testing.assert_allclose(weights[0], weights[1], atol=1e-4)


@pytest.mark.parametrize("order", [3, 4])
def test_expected_errors_are_those_that_light_of_the_prior_has(parts: np.ndarray, order: int) -> None:
    prior, need = Anywhere(SHEET.frequencies, parts), of_parts(parts)
    stddev, chance = 0.05 * np.array([0.0, 0.3, 1.0, 2.0, 4.0])[SHEET_ORDERS], np.random.default_rng(7)
    expected, actual = [], []
    for seed in range(40):
        true = parts @ chance.standard_normal((len(parts), 3))
        true += np.outer(parts[:, 0] / parts[0, 0], 1.0 - true[0])
        light = on_the_sheet(true, stddev, seed).truncated(order)
        shown, drawn = ShownLight(prior, need), DrawnLight(len(parts))
        for _ in range(3):
            shown.take_in(light)
        expected.append(shown.squared_errors(light)[-1])
        drawn.pass_to(shown.weights(light, order))
        n = len(pack_real(light.coefficients))
        # what is beyond the order cannot be told, and is not counted
        known = need.independent[:, :n] @ np.linalg.solve(need.independent[:n, :n], true[:n])
        actual.append(picture_error(need, shown.drawn(light, drawn), known))
    assert np.mean(expected) == pytest.approx(np.mean(actual), rel=0.2)


@pytest.mark.parametrize("level", [0.0, -0.2, 1e-9])
def test_darkness_tells_nothing_of_where_light_comes_from(
    natural: NaturalLight, parts: np.ndarray, level: float
) -> None:
    dark = 1e-3 * np.random.default_rng(3).standard_normal((len(parts), 3))
    dark[0] = level
    light = on_the_sheet(np.ones((len(parts), 3)) * natural.isotropic.expected[:, None], 0.01 * SHEET_ORDERS, 2)
    shown, drawn = ShownLight(natural, of_parts(parts)), DrawnLight(len(parts))
    for each in (on_the_sheet(dark, 0.01 + 0.0 * SHEET_ORDERS, 1), light):
        shown.take_in(each)
        drawn.pass_to(shown.weights(each, 4))
        drawn.wait(10.0)
        assert np.all(np.isfinite(shown.drawn(each, drawn).coefficients))
        assert np.all(np.isfinite(shown.squared_errors(each)))
    assert np.allclose(shown.drawn(light, drawn).coefficients, light.coefficients, atol=0.1)
