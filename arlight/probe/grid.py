"""The block field as a grid of cells: how many, where the reference regions stand, and which cells belong together."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from arlight.probe.design import BlockKind

Cell = tuple[int, int]
"""(column, row), row 0 at the top."""

_LONGEST_ASPECT = 1.6
_REFERENCE_SHARE = 1.0 / 9.0
_FEWEST_REFERENCES = 8


@dataclass(frozen=True, slots=True)
class Grid:
    """A full rectangle of cells, some of them references on a regular sublattice."""

    columns: int
    """Cells across."""
    rows: int
    """Cells down."""
    references: tuple[tuple[Cell, BlockKind], ...]
    """The unpatterned cells, by row, then column."""

    @property
    def pattern_cells(self) -> list[Cell]:
        """Patterned cells along a path on which four consecutive ones are neighbours.

        The path winds through strips two columns wide, down and up again.
        """
        taken = {cell for cell, _ in self.references}
        path: list[Cell] = []
        for strip, left in enumerate(range(0, self.columns, 2)):
            rows = range(self.rows) if strip % 2 == 0 else range(self.rows - 1, -1, -1)
            across = [c for c in (left, left + 1) if c < self.columns]
            for row in rows:
                path += [(c, row) for c in (across if row % 2 == 0 else across[::-1])]
        return [cell for cell in path if cell not in taken]


def choose_grid(pattern_count: int, preferred: Callable[[int, int], bool]) -> Grid:
    """The grid for a number of patterned blocks: no cell is left over, references at uniform intervals.

    About one cell in nine is a reference, as many as make the rectangle full; their intervals are about the same
    across and down.

    Args:
        pattern_count: patterned blocks, at least 4.
        preferred: whether a field of (columns, rows) is wanted, such as one that fits the page; if none is, all are
            candidates.
    """
    candidates = [
        (columns, rows, across, down)
        for columns, rows in _rectangles(pattern_count)
        for across, down in _sublattices(columns * rows - pattern_count)
    ]
    wanted = [c for c in candidates if preferred(c[0], c[1])] or candidates
    columns, rows, across, down = min(wanted, key=lambda c: (_unevenness(*c), c))
    sites = [(_spread(i, across, columns), _spread(j, down, rows)) for j, i in product(range(down), range(across))]
    return Grid(columns, rows, _with_kinds(sites, columns, rows))


def _rectangles(pattern_count: int) -> list[tuple[int, int]]:
    high = 2 * pattern_count + 8
    return [
        (columns, rows)
        for columns in range(2, int(high**0.5) + 1)
        for rows in range(columns, int(_LONGEST_ASPECT * columns) + 2)
        if pattern_count + 4 <= columns * rows <= high
    ]


def _sublattices(count: int) -> list[tuple[int, int]]:
    return [(across, count // across) for across in range(2, count // 2 + 1) if count % across == 0]


def _unevenness(columns: int, rows: int, across: int, down: int) -> float:
    """How far references are from one in nine, and their intervals from alike in both directions; 0 is best."""
    count = across * down
    # two of each kind at least, where the sheet is small
    aim = max(_REFERENCE_SHARE * columns * rows, _FEWEST_REFERENCES)
    return abs(np.log(count / aim)) + abs(np.log(columns * down / (rows * across)))


def _spread(index: int, count: int, cells: int) -> int:
    """Cell of the index-th of `count` sites at uniform intervals over `cells` cells."""
    return int((2 * index + 1) * cells / (2 * count))


def _with_kinds(sites: list[Cell], columns: int, rows: int) -> tuple[tuple[Cell, BlockKind], ...]:
    """Each site with its kind: every kind is spread over the whole field.

    Two in five are black film over black paper, which every block's mirror reflection is interpolated from.
    """
    black = max(1, 2 * len(sites) // 5)
    rest = len(sites) - black
    counts: dict[BlockKind, int] = {
        "black_black": black,
        "clear_white": (rest + 2) // 3,
        "clear_black": (rest + 1) // 3,
    }
    free, kinds = list(sites), dict[Cell, BlockKind]()
    for kind, count in counts.items():
        for cell in _spread_out(free, count, columns, rows):
            kinds[cell] = kind
            free.remove(cell)
    return tuple((cell, kinds.get(cell, "black_white")) for cell in sites)


def _spread_out(sites: list[Cell], count: int, columns: int, rows: int) -> list[Cell]:
    """`count` of the sites, so chosen that no cell of the field is far from its nearest; exchanges until none helps."""
    field = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 1, 2)
    distance = np.linalg.norm(field - np.array(sites), axis=-1)

    def cost(chosen: list[int]) -> tuple[float, float]:
        nearest = distance[:, chosen].min(axis=1)
        return float(nearest.max()), float(nearest.mean())

    chosen: list[int] = []
    while len(chosen) < count:
        chosen.append(min((i for i in range(len(sites)) if i not in chosen), key=lambda i: cost([*chosen, i])))
    best, improved = cost(chosen), True
    while improved:
        improved = False
        for place, site in product(range(count), range(len(sites))):
            trial = [*chosen[:place], site, *chosen[place + 1 :]]
            if site not in chosen and cost(trial) < best:
                chosen, best, improved = trial, cost(trial), True
    return [sites[i] for i in chosen]
