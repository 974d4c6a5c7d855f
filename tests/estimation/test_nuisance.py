"""What one frame hands to the next; how it is found is the channel fit's."""

import numpy as np

from arlight.estimation.nuisance import NUMBERS, Nuisance


def test_values_come_back():
    scales = (1.0, 2.0), (0.5, 3.0), (0.1, 0.2)
    nuisance = Nuisance.guess(0.7, 0.9, (0.05, 0.06), scales, -0.002, (0.1, -0.05))
    assert nuisance.blur_variance_px2 == 0.7
    assert nuisance.sharpness_px4 == -0.002
    assert nuisance.lower_face == 0.9
    assert nuisance.shift_px == (0.1, -0.05)
    assert nuisance.color_spread == (0.05, 0.06)
    assert nuisance.error_scale == scales
    assert nuisance.numbers.shape == (NUMBERS,)


def test_a_first_guess_knows_neither_the_light_nor_its_blocks():
    assert Nuisance.guess().shape is None
    assert Nuisance.guess().blocks is None


def test_guesses_share_no_memory():
    one, other = Nuisance.guess(), Nuisance.guess()
    assert not np.shares_memory(one.numbers, other.numbers)
