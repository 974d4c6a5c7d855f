"""Planes of a frame's blocks, and the levels that are read off them."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.measured_blocks import MeasuredBlocks
from arlight.estimation.response import optical_transfer
from arlight.tracking.block_layout import field_blocks


@pytest.fixture
def blocks(probe, response):
    """Planes of the sheet."""
    return MeasuredBlocks(
        [block.kind for block in field_blocks(probe)],
        response.sequence,
        probe.slab.refractive_index,
        response.phasor,
        response.cosine,
    )


@pytest.fixture
def kinds(probe):
    return np.array([block.kind for block in field_blocks(probe)])


@pytest.fixture
def means(blank):
    """Measurements of every value its own, some blocks unseen and some of few harmonics."""
    black = blank()
    generator = np.random.default_rng(0)
    count = len(black.valid)
    return replace(
        black,
        values=generator.uniform(0.1, 0.9, black.values.shape),
        harmonics=np.where(black.harmonics > 0, np.arange(count) % 4, 0),
        valid=np.arange(count) % 5 != 2,
        pixel_variance=generator.uniform(0.001, 0.01, (count, 3)),
        cycles_per_px=black.cycles_per_px * generator.uniform(0.3, 8.0, (count, 1)),
    )


def test_planes_are_the_measurements_in_sequence(blocks, response, means):
    count = len(means.valid)
    blocks.gather(means, count)
    seen = means.valid & (means.harmonics >= 3)
    order = response.sequence
    measured = blocks.planes["measured"].reshape(3, 7, -1)[:, :, :count]
    np.testing.assert_array_equal(measured[:, :, seen[order]], means.values[order][seen[order]].transpose(2, 1, 0))
    # what was not resolved or not seen is nothing
    assert not measured[:, :, ~means.valid[order]].any()
    assert not measured[:, 1:, (means.harmonics == 0)[order]].any()
    np.testing.assert_array_equal(blocks.planes["seen"][0, :count], means.valid[order])
    np.testing.assert_array_equal(response.phasor[0, :count], means.view_phasor[order].real)
    assert not blocks.planes["seen"][0, count:].any()


def test_a_part_of_the_sequence_leaves_the_rest_unseen(blocks, means):
    blocks.gather(means, len(means.valid))
    blocks.gather(means, 9)
    assert not blocks.planes["seen"][0, 9:12].any()


def test_pixels_leave_of_stripes_what_a_square_does(blocks, response, means):
    blocks.gather(means, len(means.valid))
    expected = optical_transfer(means.cycles_per_px, 0.0)[response.sequence, 1::2]
    np.testing.assert_allclose(blocks.planes["left"][:, : len(means.valid)].T, expected, atol=1e-12)


def test_white_is_the_median_of_the_white_blocks_that_were_seen(blocks, kinds, means):
    blocks.gather(means, len(means.valid))
    white = kinds == "clear_white"
    expected = np.median(means.values[white & means.valid, 0], axis=0)
    np.testing.assert_allclose(blocks.white, expected)
    blocks.gather(replace(means, valid=means.valid & ~white), len(means.valid))
    expected = 8.0 * np.median(means.values[(kinds == "pattern") & means.valid, 0], axis=0)
    np.testing.assert_allclose(blocks.white, expected)
    blocks.gather(replace(means, valid=np.zeros(len(white), bool)), len(means.valid))
    assert blocks.white == (0.5, 0.5, 0.5)
    blocks.gather(replace(means, values=0.0 * means.values), len(means.valid))
    assert min(blocks.white) > 0.0


def test_arrays_of_any_layout_are_read(blocks, means):
    blocks.gather(means, len(means.valid))
    expected = {name: plane.copy() for name, plane in blocks.planes.items() if name != "scratch"}
    strided = np.empty((*means.values.shape, 2))
    strided[..., 0] = means.values
    other = replace(means, values=strided[..., 0], harmonics=means.harmonics.astype(np.int32))
    blocks.gather(other, len(means.valid))
    for name, plane in expected.items():
        np.testing.assert_array_equal(blocks.planes[name], plane)
