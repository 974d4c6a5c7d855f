"""What one frame hands to the next; how it is found is the channel fit's."""

import numpy as np

from arlight.estimation.nuisance import Nuisance


def test_values_come_back():
    values = np.array([0.7, -0.002, 0.9, 0.1, -0.05])
    shape, blocks = np.array([1.0, 0.2, 0.1]), np.ones((2, 8))
    nuisance = Nuisance.of(values, (0.05, 0.06), ((1.0, 2.0),) * 3, shape, blocks)
    np.testing.assert_array_equal(nuisance.values, values)
    assert nuisance.blur_variance_px2 == 0.7
    assert nuisance.shift_px == (0.1, -0.05)
    assert nuisance.color_spread == (0.05, 0.06)
    assert nuisance.shape is shape
    assert nuisance.blocks is blocks


def test_a_first_guess_knows_neither_the_light_nor_its_blocks():
    assert Nuisance().shape is None
    assert Nuisance().blocks is None
