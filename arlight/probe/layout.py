"""Designs a sheet: block sizes from the optics, the field, the frame around it."""

from dataclasses import replace
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from arlight.errors import ProbeError
from arlight.fourier import MAX_ORDER
from arlight.optics import Slab
from arlight.probe.design import DESIGNS, Block, Design, Probe
from arlight.probe.frame_layout import DICTIONARY, FrameLayout, frame_around, place_markers, place_wedge
from arlight.probe.grid import Cell, Grid, choose_grid
from arlight.probe.pages import PAPERS, Paper, fits_page, largest_sheet_mm
from arlight.probe.validation import MOST_PIXELS_PER_SIDE

PHASES_DEG: dict[Design, tuple[float, ...]] = {"matched": (0.0, 90.0, 180.0, 270.0), "doubled": (0.0, 90.0)}
"""tau of the blocks that each frequency gets."""
VIEW_LIMIT_DEG = 70.0
"""Viewers up to this angle off the normal see a block's window free of its neighbours."""

_FEWEST_PIXELS_PER_PERIOD = 4.0


def design_probe(
    order: int = 5,
    design: Design = "matched",
    glass_mm: float = 2.44,
    refractive_index: float = 1.52,
    pixels_per_mm: float = 20.0,
    window_periods: int = 1,
    paper: Paper | None = None,
    paper_reflectance: float = 0.9,
    film_transmittance: float = 0.95,
) -> Probe:
    """A sheet that measures every frequency of the half plane up to an order.

    Args:
        order: highest order |n|, 1 to 8.
        design: `matched` or `doubled`.
        glass_mm: thickness of the glass [mm].
        refractive_index: of the glass, in (1, 4].
        pixels_per_mm: resolution of the rasters.
        window_periods: side of a block's window, in periods P of frequency (1, 0).
        paper: page that the sheet must fit, or None for any size.
        paper_reflectance: of the unprinted paper, (0, 1].
        film_transmittance: of the unprinted film, (0, 1].

    Returns:
        The sheet, its centre at the origin.

    Raises:
        ProbeError: an argument is impossible, the rasters cannot resolve the stripes, or the sheet does not fit the
            page.

    Source: section 3; the margins are geometry (see `block_size_mm`).
    """
    _check_arguments(order, design, window_periods, paper, paper_reflectance, film_transmittance)
    _check_resolution(Slab(glass_mm, refractive_index), order, design, pixels_per_mm)
    blank = Probe(
        design=design,
        order=order,
        sheet_mm=(0.0, 0.0),
        pixels_per_mm=float(pixels_per_mm),
        glass_mm=float(glass_mm),
        refractive_index=float(refractive_index),
        dictionary=DICTIONARY,
        markers=(),
        blocks=(),
        paper_reflectance=float(paper_reflectance),
        film_transmittance=float(film_transmittance),
    )
    probe = _laid_out(blank, window_periods, paper)
    if max(probe.sheet_mm) * pixels_per_mm > MOST_PIXELS_PER_SIDE:
        raise ProbeError(
            f"the sheet would be {max(probe.sheet_mm):.0f} mm long, more than {MOST_PIXELS_PER_SIDE} pixels at "
            f"{pixels_per_mm:g} pixels per mm; choose a lower order, thinner glass or fewer pixels per mm"
        )
    if paper is not None:
        require_page(probe, paper)
    return probe


def block_size_mm(slab: Slab, window_periods: int = 1, view_limit_deg: float = VIEW_LIMIT_DEG) -> float:
    """Side of a block whose window sees nothing but the block's own patterns [mm].

    A pixel of the window shows the paper up to D(view limit) to its side, and that paper is lit through film up to Dmax
    further: the window needs both on every side.
    """
    limit = np.radians(view_limit_deg)
    view = float(slab.offset_mm(np.array([np.sin(limit), 0.0, np.cos(limit)]))[0])
    return window_periods * slab.period_mm + 2.0 * (slab.max_offset_mm + view)


def require_page(probe: Probe, paper: Paper) -> None:
    """Refuse a sheet that does not fit a page.

    Raises:
        ProbeError: it does not; the message names the largest order of this design and glass that does.
    """
    if fits_page(probe.sheet_mm, paper):
        return
    width, height = largest_sheet_mm(paper)
    largest = largest_order(probe, paper)
    remedy = f"the largest order that fits is {largest}" if largest else "no order fits; choose thinner glass"
    raise ProbeError(
        f"a sheet of order {probe.order} ({probe.design}, glass of {probe.glass_mm:g} mm) measures "
        f"{probe.sheet_mm[0]:.1f} x {probe.sheet_mm[1]:.1f} mm, and {paper} takes {width:g} x {height:g} mm "
        f"with margins and marks: {remedy}"
    )


def largest_order(probe: Probe, paper: Paper) -> int:
    """Highest order whose sheet, alike in everything else, fits the page; 0 if none does."""
    window = min(block.window_mm for block in probe.blocks if block.kind == "pattern")
    periods = max(1, round(window / probe.slab.period_mm))
    orders = range(MAX_ORDER, 0, -1)
    fitting = (n for n in orders if fits_page(_laid_out(replace(probe, order=n), periods, paper).sheet_mm, paper))
    return next(fitting, 0)


def _laid_out(probe: Probe, window_periods: int, paper: Paper | None) -> Probe:
    """The sheet with its outline, blocks and markers made for its order, design and glass."""
    size, window = block_size_mm(probe.slab, window_periods), window_periods * probe.slab.period_mm
    pages = PAPERS if paper is None else (paper,)

    def frame_of(columns: int, rows: int) -> FrameLayout:
        return frame_around((columns * size, rows * size), probe.pixels_per_mm)

    def fits(columns: int, rows: int) -> bool:
        return all(fits_page(frame_of(columns, rows).sheet_mm, page) for page in pages)

    frequencies = _interleaved(probe.frequencies[1:])
    grid = choose_grid(len(frequencies) * len(PHASES_DEG[probe.design]), fits)
    field = _field(grid, frequencies, PHASES_DEG[probe.design], size, window)
    frame = frame_of(grid.columns, grid.rows)
    blocks = field + place_wedge(frame, len(field))
    return replace(probe, sheet_mm=frame.sheet_mm, markers=place_markers(frame), blocks=blocks)


def _interleaved(frequencies: NDArray[np.int64]) -> list[tuple[int, int]]:
    """The frequencies in an order that brings high and low ones to every part of the sheet.

    A lamp or a hand over one part then does not take all the frequencies of one order.
    """
    # the golden ratio's multiples fall evenly into the unit interval, however many there are
    golden = (sqrt(5.0) - 1.0) / 2.0
    sequence = np.argsort(np.arange(len(frequencies)) * golden % 1.0)
    return [(int(u), int(v)) for u, v in frequencies[sequence]]


def _field(
    grid: Grid, frequencies: list[tuple[int, int]], phases: tuple[float, ...], size: float, window: float
) -> tuple[Block, ...]:
    """Blocks of the field, numbered by row, then column."""

    def center(cell: Cell) -> tuple[float, float]:
        return (cell[0] - (grid.columns - 1) / 2.0) * size, ((grid.rows - 1) / 2.0 - cell[1]) * size

    placed: dict[Cell, Block] = {}
    patterns = [(n, tau) for n in frequencies for tau in phases]
    for cell, (n, tau) in zip(grid.pattern_cells, patterns, strict=True):
        placed[cell] = Block(0, "pattern", center(cell), size, window, n, tau)
    for cell, kind in grid.references:
        placed[cell] = Block(0, kind, center(cell), size, window)
    by_row = sorted(placed, key=lambda cell: (cell[1], cell[0]))
    return tuple(replace(placed[cell], id=number) for number, cell in enumerate(by_row))


def _check_arguments(
    order: int, design: str, window_periods: int, paper: str | None, reflectance: float, transmittance: float
) -> None:
    if not 1 <= order <= MAX_ORDER:
        raise ProbeError(f"order must lie between 1 and {MAX_ORDER}, found {order}")
    if design not in DESIGNS:
        raise ProbeError(f"design must be one of {', '.join(DESIGNS)}, found {design!r}")
    if not 1 <= window_periods <= 64:
        raise ProbeError(f"window_periods must lie between 1 and 64, found {window_periods}")
    if paper is not None and paper not in PAPERS:
        raise ProbeError(f"paper must be one of {', '.join(PAPERS)}, found {paper!r}")
    for name, value in (("paper_reflectance", reflectance), ("film_transmittance", transmittance)):
        if not 0.0 < value <= 1.0:
            raise ProbeError(f"{name} must lie in (0, 1], found {value}")


def _check_resolution(slab: Slab, order: int, design: Design, pixels_per_mm: float) -> None:
    """The finest printed stripe must be resolved by the rasters; the doubled design's paper has twice the frequency."""
    if not 1.0 <= pixels_per_mm <= 200.0:
        raise ProbeError(f"pixels_per_mm must lie between 1 and 200, found {pixels_per_mm}")
    finest = slab.period_mm / (order * (2 if design == "doubled" else 1))
    if finest * pixels_per_mm < _FEWEST_PIXELS_PER_PERIOD:
        raise ProbeError(
            f"the finest stripe has a period of {finest:.3f} mm, {finest * pixels_per_mm:.1f} pixels at "
            f"{pixels_per_mm:g} pixels per mm; at least {ceil(_FEWEST_PIXELS_PER_PERIOD / finest)} per mm are needed, "
            "or thicker glass, or a lower order"
        )
