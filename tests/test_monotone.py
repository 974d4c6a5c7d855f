"""Monotone interpolation: against scipy's, and its laws on awkward knots."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from arlight.monotone import interpolate_monotone


def uneven_knots(generator, count):
    return np.cumsum(generator.uniform(0.01, 1.0, count))


@pytest.mark.parametrize("count", [2, 3, 4, 30])
@pytest.mark.parametrize("kind", ["any", "rising", "flat in parts"])
def test_agrees_with_scipys_pchip(count, kind):
    generator = np.random.default_rng(count)
    for _ in range(50):
        knots, values = uneven_knots(generator, count), generator.normal(size=count)
        if kind == "rising":
            values = np.cumsum(np.abs(values))
        elif kind == "flat in parts":
            values = np.round(values)
        at = np.concatenate([knots, generator.uniform(knots[0], knots[-1], 40)])
        found = interpolate_monotone(at, knots, values)
        np.testing.assert_allclose(found, PchipInterpolator(knots, values)(at), atol=1e-12)


def test_a_steep_step_does_not_overshoot():
    knots, values = np.arange(6.0), np.array([0.0, 0.0, 0.001, 1.0, 1.0, 1.0])
    curve = interpolate_monotone(np.linspace(0.0, 5.0, 501), knots, values)
    assert np.all(np.diff(curve) >= 0.0)
    assert curve.min() == 0.0
    assert curve.max() == 1.0


def test_keeps_the_shape_and_takes_scalars():
    assert interpolate_monotone(0.5, [0.0, 1.0], [0.0, 2.0]) == pytest.approx(1.0)
    assert interpolate_monotone(np.zeros((3, 4, 2)), [0.0, 1.0, 2.0], [5.0, 2.0, 1.0]).shape == (3, 4, 2)


def test_a_straight_line_stays_straight():
    knots = np.array([0.0, 0.1, 0.7, 3.0])
    at = np.linspace(0.0, 3.0, 31)
    np.testing.assert_allclose(interpolate_monotone(at, knots, 2.0 - 3.0 * knots), 2.0 - 3.0 * at, atol=1e-12)
