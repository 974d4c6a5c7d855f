"""The field's grid is full, and its references stand at uniform intervals."""

from itertools import combinations

import numpy as np
import pytest

from arlight.probe.grid import choose_grid

COUNTS = [4, 8, 12, 24, 28, 48, 56, 80, 96, 112, 148, 160, 196, 224, 296, 392]


def anything(_columns, _rows):
    return True


@pytest.mark.parametrize("count", COUNTS)
def test_no_cell_is_left_over(count):
    grid = choose_grid(count, anything)
    cells = grid.pattern_cells + [cell for cell, _ in grid.references]
    assert len(grid.pattern_cells) == count
    assert sorted(cells) == [(c, r) for c in range(grid.columns) for r in range(grid.rows)]


@pytest.mark.parametrize("count", COUNTS)
def test_references_form_a_regular_sublattice(count):
    grid = choose_grid(count, anything)
    columns = sorted({cell[0] for cell, _ in grid.references})
    rows = sorted({cell[1] for cell, _ in grid.references})
    assert len(columns) * len(rows) == len(grid.references)
    for places, cells in ((columns, grid.columns), (rows, grid.rows)):
        steps = np.diff(places)
        assert np.ptp(steps) <= 1
        # the first and the last stand about half an interval from the edge
        assert abs(places[0] - (cells - 1 - places[-1])) <= 1


@pytest.mark.parametrize("count", COUNTS)
def test_every_kind_is_there(count):
    kinds = [kind for _, kind in choose_grid(count, anything).references]
    assert {"clear_white", "clear_black", "black_white", "black_black"} == set(kinds)
    assert kinds.count("black_black") == max(kinds.count(kind) for kind in set(kinds))


@pytest.mark.parametrize("count", [24, 56, 96])
def test_black_references_are_placed_as_well_as_any(count):
    grid = choose_grid(count, anything)
    field = np.stack(np.meshgrid(np.arange(grid.columns), np.arange(grid.rows)), axis=-1).reshape(-1, 1, 2)

    def reach(cells):
        return np.linalg.norm(field - np.array(cells), axis=-1).min(axis=1).max()

    chosen = [cell for cell, kind in grid.references if kind == "black_black"]
    sites = [cell for cell, _ in grid.references]
    assert reach(chosen) == min(reach(cells) for cells in combinations(sites, len(chosen)))


def test_preference_is_followed_where_it_can_be():
    tall = choose_grid(160, lambda columns, _rows: columns <= 11)
    assert tall.columns <= 11
    assert choose_grid(160, lambda _columns, _rows: False).pattern_cells == choose_grid(160, anything).pattern_cells
