import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arlight.video.chroma_grid import axis_grid

SITES = [(0, 0.0), (1, 0.0), (1, 0.5), (1, 1.0), (1, -0.5), (2, 0.0), (2, 1.5)]


@pytest.mark.parametrize(("shift", "offset"), SITES)
@given(length=st.integers(1, 40), data=st.data())
def test_both_filters_keep_a_constant(shift, offset, length, data):
    start = data.draw(st.integers(0, length - 1))
    stop = data.draw(st.integers(start + 1, length))
    grid = axis_grid(length, start, stop, shift, offset)
    assert grid.tap_weights.sum() == pytest.approx(1.0, abs=1e-6)
    assert grid.taps.min() >= 0
    assert grid.taps.max() < length
    assert grid.lower.min() >= 0
    assert grid.upper.max() < grid.chroma_count
    assert grid.chroma_start + grid.chroma_count <= -(-length >> shift)
    assert np.all((grid.weight >= 0) & (grid.weight < 1))


@pytest.mark.parametrize(("shift", "offset"), SITES)
def test_a_ramp_is_averaged_to_its_value_at_the_chroma_sample_and_interpolated_back(shift, offset):
    length, ramp = 64, np.arange(64.0)
    grid = axis_grid(length, 0, length, shift, offset)
    low = ramp[grid.taps] @ grid.tap_weights
    inner = slice(2, -2)
    sites = offset + np.arange(grid.chroma_count) * (1 << shift)
    np.testing.assert_allclose(low[inner], sites[inner], atol=1e-5)
    back = sites[grid.lower] * (1 - grid.weight) + sites[grid.upper] * grid.weight
    np.testing.assert_allclose(back[8:-8], ramp[8:-8], atol=1e-5)


@pytest.mark.parametrize(("offset", "weights"), [(0.0, [0.25, 0.5, 0.25]), (0.5, [0.5, 0.5]), (1.0, [0.25, 0.5, 0.25])])
def test_the_average_is_the_box_around_the_sample(offset, weights):
    np.testing.assert_allclose(axis_grid(32, 0, 32, 1, offset).tap_weights, weights)
