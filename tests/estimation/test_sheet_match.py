"""The share of the stripes that a fit does not explain, and when nothing can be said."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.response import optical_transfer
from arlight.estimation.sheet_match import unexplained_share
from arlight.tracking.block_means import ROWS, BlockMeans

COUNT = 12


@pytest.fixture
def means():
    """Twelve blocks, two of them without a pattern, with stripes of amplitude 0.1 and more."""
    generator = np.random.default_rng(0)
    values = np.zeros((COUNT, ROWS, 3))
    values[:, 0] = 0.5
    values[:, 1:3] = generator.uniform(0.1, 0.2, (COUNT, 2, 1))
    cycles = np.full((COUNT, 2), [0.1, 0.05])
    cycles[-2:] = 0.0
    return BlockMeans(
        values=values,
        covariance=np.tile(np.eye(ROWS), (COUNT, 1, 1)),
        pixel_variance=np.full((COUNT, 3), 1e-4),
        shading=np.zeros((COUNT, 3)),
        harmonics=np.where(np.any(cycles != 0, axis=1), 3, 0),
        samples=np.full(COUNT, 400),
        valid=np.ones(COUNT, bool),
        view_phasor=np.ones(COUNT, complex),
        view_cosine=np.ones(COUNT),
        cycles_per_px=cycles,
        color_trust=np.ones(COUNT),
    )


def share(means, predicted, blur_px2=0.4):
    transfer = optical_transfer(means.cycles_per_px, blur_px2)
    return unexplained_share(means, 1, 1.0, predicted, transfer)


def test_a_perfect_fit_leaves_nothing_and_no_fit_leaves_all(means):
    measured = means.values[:, :, 1]
    assert share(means, measured) == 0.0
    # 0.01 of white counts as no stripes: 0.1 / 0.11 is the least that can be left
    assert 0.9 < share(means, np.zeros_like(measured)) < 1.0


def test_a_fit_that_misses_a_share_leaves_that_share(means):
    assert share(means, 0.7 * means.values[:, :, 1]) == pytest.approx(0.3, rel=0.1)


def test_it_does_not_depend_on_the_level_of_the_light(means):
    brighter = replace(means, values=3.0 * means.values)
    transfer = optical_transfer(means.cycles_per_px, 0.4)
    dim = unexplained_share(means, 1, 1.0, 0.6 * means.values[:, :, 1], transfer)
    assert unexplained_share(brighter, 1, 3.0, 0.6 * brighter.values[:, :, 1], transfer) == pytest.approx(dim)


def test_a_hand_over_less_than_half_of_the_blocks_does_not_count(means):
    predicted = means.values[:, :, 1].copy()
    hidden = replace(means, values=means.values.copy())
    hidden.values[:4, 1:] = 0.0
    assert share(hidden, predicted) == 0.0


def test_mean_and_higher_harmonics_do_not_count(means):
    predicted = means.values[:, :, 1].copy()
    predicted[:, 0] += 0.3
    predicted[:, 3:] += 0.3
    assert share(means, predicted) == 0.0


@pytest.mark.parametrize("reason", ["blurred", "clipped", "too fine"])
def test_where_no_stripes_are_resolved_nothing_is_said(means, reason):
    nothing = np.zeros((COUNT, ROWS))
    if reason == "blurred":
        assert np.isnan(share(means, nothing, blur_px2=8.0))
    elif reason == "clipped":
        assert np.isnan(share(replace(means, valid=np.zeros(COUNT, bool)), nothing))
    else:
        assert np.isnan(share(replace(means, harmonics=np.zeros(COUNT, np.int64)), nothing))


def test_a_few_blocks_are_not_enough(means):
    nothing = np.zeros((COUNT, ROWS))
    for seen, known in ((3, False), (4, True)):
        assert np.isfinite(share(replace(means, valid=np.arange(COUNT) < seen), nothing)) == known
