"""What is measured on a block has the same places everywhere."""

from arlight.tracking import block_kernels
from arlight.tracking.block_means import HARMONICS, ROWS


def test_rows_are_a_mean_and_two_for_each_harmonic():
    assert ROWS == 1 + 2 * HARMONICS


def test_compiled_code_has_the_same_rows_and_room_for_the_widest_fit():
    assert block_kernels.ROWS == ROWS
    cubic = sum(1 for a in range(4) for b in range(4) if a + b <= 3)
    assert cubic - 1 + ROWS <= block_kernels.MAX_COLUMNS
