"""Blocks whose stripes stray lose weight, as a Student-t distribution has it."""

import numpy as np
import pytest
from scipy.stats import multivariate_t

from arlight.estimation.robust_weights import block_weights, harmonic_squares

USABLE = np.ones((1, 7), bool)


def squares(size, rows=7):
    """A block all of whose rows are off by the same number of standard deviations."""
    return np.full((1, rows), size**2)


@pytest.mark.parametrize("freedom", [2.0, 8.0])
@pytest.mark.parametrize("size", [0.1, 1.0, 6.0])
def test_weights_are_the_slope_of_the_t_distributions_likelihood(freedom, size):
    step = 1e-5
    log = multivariate_t(np.zeros(6), np.eye(6), df=freedom).logpdf
    slope = (log(np.full(6, size + step)) - log(np.full(6, size - step))) / (2 * step)
    # of a normal distribution it is the residual itself, six times
    assert block_weights(squares(size), USABLE, freedom)[0] == pytest.approx(-slope / (6 * size), rel=1e-6)


def test_one_stray_harmonic_costs_the_whole_block_and_no_other():
    squared = np.ones((3, 7))
    squared[1, 4] = 400.0
    weights = block_weights(squared, np.ones((3, 7), bool))
    assert weights[1] < 0.05
    np.testing.assert_allclose(weights[[0, 2]], 1.0)


def test_a_stray_mean_is_left_to_the_lamps():
    squared = squares(1.0)
    squared[0, 0] = 1e6
    np.testing.assert_array_equal(block_weights(squared, USABLE), block_weights(squares(1.0), USABLE))


def test_rows_that_are_not_usable_have_no_say():
    usable, garbage = USABLE.copy(), squares(1.0)
    usable[0, 5:] = False
    garbage[0, 5:] = np.nan
    total, count = harmonic_squares(garbage, usable)
    assert (total[0], count[0]) == (4.0, 4)
    assert block_weights(garbage, usable)[0] == pytest.approx(1.0)


def test_without_harmonics_nothing_is_doubted():
    nothing = np.zeros((1, 7), bool)
    np.testing.assert_array_equal(block_weights(squares(9.0), nothing), 1.0)
