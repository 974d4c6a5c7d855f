"""Blocks of a sheet as arrays, and the part of it with coarse stripes."""

import numpy as np
import pytest

from arlight.calibration.layers.sheet_blocks import SheetBlocks, coarse_part
from arlight.fourier import frequency_order
from arlight.tracking.block_layout import field_blocks


@pytest.fixture(scope="module")
def probe(filmed_sheet):
    return filmed_sheet.probe


def test_arrays_follow_the_field(probe):
    blocks, arrays = field_blocks(probe), SheetBlocks.of(probe)
    np.testing.assert_array_equal(arrays.centers_mm, [block.center_mm for block in blocks])
    for number, block in enumerate(blocks):
        assert arrays.white[number] == (block.kind == "clear_white")
        assert arrays.black[number] == (block.kind in ("clear_black", "black_white", "black_black"))
    assert len(arrays.basis) == len(arrays.mean_model) == len(blocks)
    # bounced light makes white the least well known
    assert arrays.mean_model[arrays.white].min() > arrays.mean_model[~arrays.white].max()


def test_a_coarse_part_keeps_what_has_no_fine_stripes(probe, measured_views):
    part, views = coarse_part(probe, measured_views, 1)
    kept = field_blocks(part)
    assert {block.id for block in kept} == {
        block.id for block in field_blocks(probe) if block.frequency is None or frequency_order(block.frequency) <= 1
    }
    assert sum(block.kind == "pattern" for block in kept) == 8
    assert len(part.frequencies) == len(probe.frequencies)
    place = {block.id: number for number, block in enumerate(field_blocks(probe))}
    for view, whole in zip(views, measured_views, strict=True):
        for number, block in enumerate(kept):
            np.testing.assert_array_equal(view.means.values[number], whole.means.values[place[block.id]])
            assert view.film_phase_rad[number] == whole.film_phase_rad[place[block.id]]


def test_the_highest_order_is_the_whole_sheet(probe, measured_views):
    part, views = coarse_part(probe, measured_views, probe.order)
    assert part.blocks == probe.blocks
    np.testing.assert_array_equal(views[0].means.values, measured_views[0].means.values)
