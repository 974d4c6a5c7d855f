"""Light that is known about where it comes from, against lamps and skies that are summed up by themselves."""

import numpy as np
import pytest

from arlight.estimation.natural_light import NaturalLight
from arlight.fourier import frequency_order, pack_real
from arlight.probe.layout import design_probe
from arlight.synthetic.captured import load_environment

PROBE = design_probe(order=4)
ORDERS = np.concatenate([[0], np.repeat(frequency_order(PROBE.frequencies)[1:], 2)])


@pytest.fixture(scope="module")
def natural() -> NaturalLight:
    return NaturalLight(PROBE.slab, PROBE.frequencies)


def captured(name: str, yaw_rad: float) -> np.ndarray:
    """(m, 3) coefficients of an environment, of a level of 1."""
    packed = pack_real(load_environment(name).rotated(yaw_rad).coefficients(PROBE.slab, PROBE.frequencies))
    return packed / packed[0].mean()


def lamp(direction: np.ndarray, share: float, natural: NaturalLight) -> np.ndarray:
    """(m,) coefficients of light that is as expected but for a lamp, of a level of 1."""
    point = np.exp(-2j * np.pi * (PROBE.frequencies @ PROBE.slab.light_plane(direction)))
    return (1.0 - share) * natural.isotropic.expected + share * pack_real(point)


def errors(stddev: float) -> np.ndarray:
    """Covariance of errors that grow with the order as a sheet's do."""
    return np.diag((stddev * np.array([0.1, 1.0, 2.0, 4.0, 8.0])[ORDERS]) ** 2)


def test_light_that_is_as_expected_may_come_from_anywhere(natural: NaturalLight) -> None:
    likely = natural.as_bright_as(natural.isotropic.expected)
    np.testing.assert_allclose(likely.expected, natural.isotropic.expected, atol=1e-5)
    np.testing.assert_allclose(likely.covariance, natural.isotropic.covariance, atol=1e-5)


def test_what_is_expected_and_how_it_varies_are_of_a_level_of_one(natural: NaturalLight) -> None:
    for likely in (natural.isotropic, natural.as_bright_as(lamp(np.array([0.6, 0.0, 0.8]), 0.5, natural))):
        assert likely.expected[0] == pytest.approx(1.0)
        np.testing.assert_allclose(likely.covariance[0], 0.0, atol=1e-5)
        assert np.all(np.linalg.eigvalsh(likely.covariance[1:, 1:]) > 0.0)


def test_light_varies_where_it_is_bright(natural: NaturalLight) -> None:
    here, there = np.array([0.6, 0.0, 0.8]), np.array([-0.6, 0.0, 0.8])
    likely = natural.as_bright_as(lamp(here, 0.5, natural))
    # a lamp that gets brighter or darker at the same level
    changes = [lamp(direction, 0.1, natural) - natural.isotropic.expected for direction in (here, there)]
    surprise, before = (
        [change[1:] @ np.linalg.solve(each.covariance[1:, 1:], change[1:]) for change in changes]
        for each in (likely, natural.isotropic)
    )
    assert before[0] == pytest.approx(before[1], rel=0.1)
    assert surprise[0] < 0.5 * surprise[1]


def test_the_first_coefficients_alone_tell_the_same_as_with_what_they_make_most_probable(natural: NaturalLight) -> None:
    n = int(np.sum(ORDERS <= 2))
    guess = lamp(np.array([0.0, 0.6, 0.8]), 0.3, natural)[:n]
    covariance = natural.isotropic.covariance + np.outer(natural.isotropic.expected, natural.isotropic.expected)
    completed = covariance[:, :n] @ np.linalg.solve(covariance[:n, :n], guess)
    few, all_of_them = natural.as_bright_as(guess), natural.as_bright_as(completed)
    np.testing.assert_allclose(few.expected, all_of_them.expected[:n], atol=1e-5)
    np.testing.assert_allclose(few.covariance, all_of_them.covariance[:n, :n], atol=1e-5)


def test_knowing_where_light_comes_from_brings_captured_light_closer_to_the_truth(natural: NaturalLight) -> None:
    chance, stated, ratios = np.random.default_rng(5), errors(0.02), []
    for name in ("apartment", "bridge", "hall", "studio"):
        squares = np.zeros(2)
        for yaw_rad in np.arange(0.0, 2.0 * np.pi, 0.7):
            true = captured(name, yaw_rad)
            measured = true + np.sqrt(np.diag(stated))[:, None] * chance.standard_normal(true.shape)
            guess = natural.isotropic.weights(stated) @ measured
            better = natural.as_bright_as(guess.mean(axis=1)).weights(stated) @ measured
            squares += [np.sum((each - true) ** 2) for each in (guess, better)]
        ratios.append(np.sqrt(squares[1] / squares[0]))
    assert np.mean(ratios) < 0.9
    assert max(ratios) < 1.05
