"""The accuracy table, on the smallest footage that still says something."""

from fractions import Fraction

import pytest

from arlight.benchmark.accuracy import AccuracySettings, accuracy_table
from arlight.probe.layout import design_probe
from arlight.synthetic.settings import SynthesisSettings, default_camera


@pytest.fixture(scope="module")
def cells():
    footage = SynthesisSettings(path="still", camera=default_camera((320, 240)), frame_rate=Fraction(25))
    settings = AccuracySettings(tilts_deg=(20.0, 50.0), widths_px=(140.0, 230.0), frames=24, footage=footage)
    return list(accuracy_table(settings, design_probe(1)))


def test_a_cell_for_every_tilt_and_width(cells):
    assert [(cell.tilt_deg, cell.width_px) for cell in cells] == [(20, 140), (20, 230), (50, 140), (50, 230)]
    assert all(cell.filtered.frames == 24 for cell in cells)
    assert all([error.order for error in cell.filtered.orders] == [0, 1] for cell in cells)


def test_a_near_sheet_is_measured_well_from_every_tilt(cells):
    for cell in cells:
        if cell.width_px == 230.0:
            assert cell.filtered.tracked_share == 1.0
            assert cell.filtered.orders[0].relative_to_l0 < 0.05
            assert cell.filtered.orders[1].relative_to_l0 < 0.05


def test_time_does_not_make_it_worse(cells):
    for cell in cells:
        filtered, single = cell.filtered.all_orders, cell.single_frame.all_orders
        assert filtered is not None
        assert single is not None
        # systematic errors stay, noise is averaged
        assert filtered.relative_to_l0 <= 1.1 * single.relative_to_l0


def test_no_single_frame_beats_its_bound_and_a_nearer_sheet_has_a_lower_one(cells):
    for cell in cells:
        # the median over frames and a prior may fall a little below the bound of the rms
        assert cell.single_frame.orders[1].relative_to_l0 > 0.5 * cell.bound[1]
    far, near = cells[0], cells[1]
    assert all(n < f for n, f in zip(near.bound, far.bound, strict=True))
