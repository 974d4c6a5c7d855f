"""The share of the stripes that no light explains on this sheet, and when nothing can be said."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.nuisance import Nuisance


@pytest.fixture(scope="module")
def estimator(probe):
    return LightingEstimator(probe)


@pytest.fixture
def means(blank, lit, random_light):
    """The sheet under some light, a little noise on it."""
    return lit(blank(sigma=0.002), random_light(0), noise_seed=0)


def foreign(means, seed=0):
    """Stripes of another sheet: each block has those of some other one."""
    order = np.arange(len(means.valid))
    patterned = np.flatnonzero(means.harmonics > 0)
    order[patterned] = np.random.default_rng(seed).permutation(patterned)
    return replace(means, values=means.values[order])


def unexplained(estimator, means, nuisance=None):
    return estimator.estimate(means, 0.0, nuisance).unexplained


def test_the_sheets_own_stripes_are_explained_and_anothers_are_not(estimator, means):
    assert unexplained(estimator, means) < 0.05
    for seed in range(3):
        assert unexplained(estimator, foreign(means, seed)) > 0.4


def test_it_does_not_depend_on_the_level_of_the_light(estimator, means):
    other = foreign(means)
    dimmer = replace(other, values=0.3 * other.values, pixel_variance=0.09 * other.pixel_variance)
    assert unexplained(estimator, dimmer) == pytest.approx(unexplained(estimator, other), rel=0.01)


def test_a_hand_over_less_than_half_of_the_blocks_does_not_count(estimator, means):
    hidden = replace(means, values=means.values.copy())
    hidden.values[np.random.default_rng(1).random(len(means.valid)) < 0.25, 1:] = 0.0
    assert unexplained(estimator, hidden) < 0.1


def test_where_no_stripes_are_resolved_nothing_is_said(estimator, means, blank, lit, random_light):
    assert np.isnan(unexplained(estimator, replace(means, valid=np.zeros(len(means.valid), bool))))
    assert np.isnan(unexplained(estimator, replace(means, harmonics=np.zeros_like(means.harmonics))))
    small = blank()
    small = replace(small, cycles_per_px=3.0 * small.cycles_per_px)
    blurred = lit(small, random_light(0), blur_variance_px2=6.0)
    assert np.isnan(unexplained(estimator, blurred, Nuisance.guess(6.0)))


def test_a_few_blocks_are_not_enough(estimator, means):
    patterned = np.flatnonzero(means.harmonics > 0)
    for count, known in ((3, False), (12, True)):
        valid = np.zeros(len(means.valid), bool)
        valid[patterned[:count]] = True
        assert np.isfinite(unexplained(estimator, replace(means, valid=valid))) == known
