"""Where the blocks of the field lie in the image, and which of their pixels may be used."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.optics import Slab
from arlight.probe.assembly import Assembly
from arlight.probe.design import Block, Probe

Array = NDArray[np.float64]

PATTERNED, WHITE, WANTED = 1, 2, 4
"""What the compiled code knows of a block's kind, and whether it is to be measured; bits."""


def field_blocks(probe: Probe) -> tuple[Block, ...]:
    """The blocks that measure light: all but the wedge."""
    return tuple(block for block in probe.blocks if block.kind != "wedge")


def design_cycles_per_mm(blocks: tuple[Block, ...], period_mm: float) -> Array:
    """(blocks, 2) frequency n / P of each block's stripes as designed, 0 where there are none [1/mm]."""
    frequencies = np.array([block.frequency or (0, 0) for block in blocks], float).reshape(-1, 2)
    return np.asarray(frequencies / period_mm, float)


@dataclass(frozen=True)
class BlockLayout:
    """The blocks' geometry on the sheet, as arrays."""

    centers_mm: Array
    """(blocks, 2) centres in the probe frame [mm]."""
    half_mm: Array
    """(blocks,) half the side [mm]."""
    cycles_per_mm: Array
    """(blocks, 2) frequency of the film's pattern, 0 where there is none [1/mm]."""
    phase_rad: Array
    """(blocks,) phase of the film's pattern at the probe frame's origin [rad]."""
    slab: Slab
    """The glass."""
    flags: NDArray[np.uint8]
    """(blocks,) bits."""
    white: NDArray[np.bool_]
    """(blocks,) clear film on white paper."""
    black: NDArray[np.bool_]
    """(blocks,) black film or black paper."""

    @classmethod
    def of_probe(cls, probe: Probe, assembly: Assembly | None = None) -> "BlockLayout":
        """The layout of a sheet's field; its patterns lie where the assembled film has them."""
        blocks = field_blocks(probe)
        film = (assembly or Assembly()).film.registration
        cycles = film.cycles_per_mm(design_cycles_per_mm(blocks, probe.slab.period_mm))
        patterned = np.array([block.kind == "pattern" for block in blocks])
        white = np.array([block.kind == "clear_white" for block in blocks])
        return cls(
            np.array([block.center_mm for block in blocks], float).reshape(-1, 2),
            np.array([block.size_mm / 2.0 for block in blocks]),
            cycles,
            -2.0 * np.pi * cycles @ np.array(film.shift_mm),
            (assembly or Assembly()).slab(probe),
            (PATTERNED * patterned + WHITE * white + WANTED).astype(np.uint8),
            white,
            np.array([block.kind in ("clear_black", "black_white", "black_black") for block in blocks]),
        )
