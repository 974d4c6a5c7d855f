"""What is measured on a block has the same places everywhere."""

from arlight.tracking.block_means import HARMONICS, ROWS


def test_rows_are_a_mean_and_two_for_each_harmonic():
    assert ROWS == 1 + 2 * HARMONICS
