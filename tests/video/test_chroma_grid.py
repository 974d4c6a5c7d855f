import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arlight.video.chroma_grid import axis_grid

SITES = [(0, 0.0), (1, 0.0), (1, 0.5), (1, 1.0), (1, -0.5), (2, 0.0), (2, 1.5)]


@pytest.mark.parametrize(("shift", "offset"), SITES)
@settings(deadline=None)
@given(length=st.integers(1, 40))
def test_both_filters_keep_a_constant(shift, offset, length):
    grid = axis_grid(length, shift, offset)
    samples = -(-length >> shift)
    assert grid.tap_weights.sum() == pytest.approx(1.0, abs=1e-6)
    assert grid.taps.shape == (len(grid.tap_weights), samples)
    assert grid.taps.min() >= 0
    assert grid.taps.max() < length
    assert np.all(np.diff(grid.taps, axis=0) >= 0)
    assert np.all(np.diff(grid.taps, axis=1) >= 0)
    assert grid.lower.min() >= 0
    assert grid.upper.max() < samples
    assert np.all((grid.upper - grid.lower <= 1) & (grid.upper >= grid.lower))
    assert np.all((grid.weight >= 0) & (grid.weight < 1))


@pytest.mark.parametrize(("shift", "offset"), SITES)
def test_a_ramp_is_averaged_to_its_value_at_the_chroma_sample_and_interpolated_back(shift, offset):
    length, ramp = 64, np.arange(64.0)
    grid = axis_grid(length, shift, offset)
    low = grid.tap_weights @ ramp[grid.taps]
    inner = slice(2, -2)
    sites = offset + np.arange(grid.taps.shape[1]) * (1 << shift)
    np.testing.assert_allclose(low[inner], sites[inner], atol=1e-5)
    back = sites[grid.lower] * (1 - grid.weight) + sites[grid.upper] * grid.weight
    np.testing.assert_allclose(back[8:-8], ramp[8:-8], atol=1e-5)


@pytest.mark.parametrize(("offset", "weights"), [(0.0, [0.25, 0.5, 0.25]), (0.5, [0.5, 0.5]), (1.0, [0.25, 0.5, 0.25])])
def test_the_average_is_the_box_around_the_sample(offset, weights):
    np.testing.assert_allclose(axis_grid(32, 1, offset).tap_weights, weights)
