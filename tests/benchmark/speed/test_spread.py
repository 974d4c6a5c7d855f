"""Medians and paired ratios."""

import numpy as np
import pytest

from arlight.benchmark.speed.spread import block_means, paired_ratio, spread


def test_most_of_the_values_lie_between_low_and_high():
    values = np.random.default_rng(1).lognormal(size=1000)
    found = spread(values)
    assert np.mean(values < found.low) == pytest.approx(0.1, abs=0.002)
    assert np.mean(values < found.median) == pytest.approx(0.5, abs=0.002)
    assert np.mean(values > found.high) == pytest.approx(0.1, abs=0.002)
    assert found.count == 1000


def test_the_true_median_is_hardly_below_the_least():
    generator = np.random.default_rng(3)
    for count in (6, 20, 48):
        # the true median is 1
        below = [spread(generator.lognormal(size=count)).least > 1.0 for _ in range(4000)]
        # 0.025 at most; the step to the next rank is wide for few values
        assert 0.002 < np.mean(below) < 0.031


def test_the_least_of_very_many_values_is_close_to_their_median():
    found = spread(np.arange(20_000.0))
    assert 0.98 * found.median < found.least < found.median


def test_of_a_few_values_the_smallest_is_the_least():
    assert spread([3.0, 2.0, 5.0, 4.0, 9.0]).least == 2.0


def test_a_single_value_is_everything():
    assert spread([3.0]).low == spread([3.0]).median == spread([3.0]).high == 3.0


def test_another_unit_scales_all_of_it():
    in_s, in_ms = spread([0.001, 0.002, 0.004]), spread([1.0, 2.0, 4.0])
    scaled = in_s.scaled(1e3)
    assert (scaled.low, scaled.median, scaled.high) == pytest.approx((in_ms.low, in_ms.median, in_ms.high))
    assert scaled.least == pytest.approx(in_ms.least)


def test_what_slows_both_of_a_pair_leaves_their_ratio():
    machine = np.random.default_rng(2).uniform(1.0, 10.0, 50)
    ratio = paired_ratio(list(0.25 * machine), list(machine))
    assert (ratio.low, ratio.median, ratio.high) == pytest.approx((0.25, 0.25, 0.25))


def test_blocks_have_the_mean_of_what_comes_in_turns():
    # one costly frame in four, and two that are left over
    assert block_means([4.0, 0.0, 0.0, 0.0] * 3 + [4.0, 0.0], 4) == [1.0, 1.0, 1.0]
    assert block_means([1.0, 2.0], 4) == []


def test_an_interruption_of_a_few_pairs_does_not_move_the_median():
    measured = np.full(20, 2.0)
    measured[:4] = 100.0
    assert paired_ratio(list(measured), [4.0] * 20).median == 0.5


def test_what_was_not_measured_in_pairs_is_refused():
    with pytest.raises(ValueError, match="shape"):
        paired_ratio([1.0, 2.0, 3.0], [1.0, 2.0])
