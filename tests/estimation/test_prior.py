import numpy as np
import pytest

from arlight.estimation.prior import COLOR_SPREAD, color_spread, color_stddev, prior_stddev
from arlight.fourier import frequency_order, half_plane_frequencies

FREQUENCIES = half_plane_frequencies(5)
ORDERS = np.concatenate([[0], np.repeat(frequency_order(FREQUENCIES[1:]), 2)])


def spread(irradiance):
    return prior_stddev(FREQUENCIES, irradiance)


def difference(irradiance):
    return color_stddev(FREQUENCIES, irradiance, COLOR_SPREAD)


@pytest.mark.parametrize("stddev", [spread, difference])
def test_every_unknown_has_a_spread(stddev):
    assert stddev(2.0).shape == (2 * len(FREQUENCIES) - 1,)
    assert np.all(np.isfinite(stddev(2.0)))
    assert stddev(2.0).min() > 0


@pytest.mark.parametrize("stddev", [spread, difference])
def test_directed_light_scales_with_the_scene(stddev):
    np.testing.assert_allclose(stddev(3.0)[1:], 3 * stddev(1.0)[1:], rtol=1e-12)
    # the mean is what is to be found: no guess of it narrows its own prior
    assert stddev(3.0)[0] == stddev(1.0)[0]
    assert stddev(3.0)[0] > 2 * np.pi


@pytest.mark.parametrize("stddev", [spread, difference])
def test_finer_light_is_weaker_and_direction_does_not_matter(stddev):
    by_order = [np.unique(stddev(1.0)[order == ORDERS]) for order in range(1, 6)]
    assert all(len(values) == 1 for values in by_order)
    assert np.all(np.diff(np.concatenate(by_order)) < 0)


def test_colours_stray_less_than_light():
    assert np.all(difference(1.0)[1:] < 0.5 * spread(1.0)[1:])
    np.testing.assert_allclose(color_stddev(FREQUENCIES, 1.0, 0.02)[1:], difference(1.0)[1:] * 0.02 / COLOR_SPREAD)


def test_positive_light_is_not_excluded():
    """One lamp is the most directed light there is: |L_n| = L_0, three standard deviations at most at order 1."""
    assert 3 * np.sqrt(2) * spread(1.0)[1] > 1


@pytest.mark.parametrize("irradiance", [0.0, -1.0])
def test_darkness_keeps_a_spread(irradiance):
    for stddev in (spread, difference):
        assert stddev(irradiance).min() > 0


def learnt(truth, noise, start=COLOR_SPREAD, frames=400):
    """Where repeated estimates of one scene's colourfulness lead, each shrunk by the spread learnt so far."""
    generator = np.random.default_rng(0)
    unit = color_stddev(FREQUENCIES, 2.0, 1.0)
    colour = truth * unit * generator.normal(size=len(unit))
    observed = colour + noise * unit * generator.normal(size=len(unit))
    found = start
    for _ in range(frames):
        prior = (found * unit) ** 2
        share = prior / (prior + (noise * unit) ** 2)
        found = color_spread(FREQUENCIES, 2.0, share * observed, share * (noise * unit) ** 2, found)
    return found, np.sqrt(np.mean((colour / unit)[1:] ** 2))


@pytest.mark.parametrize("truth", [0.02, 0.08, 0.15])
def test_the_scenes_colourfulness_is_learnt(truth):
    found, actual = learnt(truth, noise=0.2 * truth)
    # 80 unknowns: a standard deviation is known to a twelfth, noise adds little
    assert found == pytest.approx(actual, rel=0.1)


def test_where_it_starts_does_not_matter():
    low, _ = learnt(0.05, 0.02, start=0.01)
    high, _ = learnt(0.05, 0.02, start=0.2)
    assert low == pytest.approx(high, rel=1e-3)


def test_learnt_colourfulness_stays_within_reason():
    nothing = np.zeros(len(ORDERS))
    least = COLOR_SPREAD
    for _ in range(20):
        least = color_spread(FREQUENCIES, 1.0, nothing, nothing, least)
    most = color_spread(FREQUENCIES, 1.0, np.full(len(ORDERS), 1e6), nothing, COLOR_SPREAD)
    assert 0 < least < 0.1 * COLOR_SPREAD
    assert COLOR_SPREAD < most < 1.0


def test_the_means_difference_is_no_colourfulness():
    first, variance = np.zeros(len(ORDERS)), np.full(len(ORDERS), 1e-4)
    moved = first.copy()
    moved[0] = 100.0
    assert color_spread(FREQUENCIES, 1.0, moved, variance, COLOR_SPREAD) == color_spread(
        FREQUENCIES, 1.0, first, variance, COLOR_SPREAD
    )
