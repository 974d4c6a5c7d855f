"""The blocks of a sheet's field as a fit needs them: arrays by block, and coarse stripes alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layers.sheet_view import SheetView
from arlight.estimation.reflection import reflection_basis
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL
from arlight.fourier import frequency_order
from arlight.probe.design import Block, Probe
from arlight.tracking.block_layout import field_blocks

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SheetBlocks:
    """What a fit needs to know of the blocks, whichever way they were assembled."""

    centers_mm: Array
    """(blocks, 2) centres in the probe frame [mm]."""
    white: NDArray[np.bool_]
    """(blocks,) clear film on white paper."""
    black: NDArray[np.bool_]
    """(blocks,) black film or black paper, without pattern."""
    mean_model: Array
    """(blocks,) error of the model in the means, relative to white."""
    basis: Array
    """(blocks, s) of the reflection field."""

    @classmethod
    def of(cls, probe: Probe) -> "SheetBlocks":
        """The blocks of a sheet's field."""
        blocks = field_blocks(probe)
        centers = np.array([block.center_mm for block in blocks], float)
        kinds = np.array([block.kind for block in blocks])
        white = kinds == "clear_white"
        black = np.isin(kinds, ["clear_black", "black_white", "black_black"])
        return cls(centers, white, black, np.where(white, WHITE_MODEL, MEAN_MODEL), reflection_basis(centers))


def coarse_part(probe: Probe, views: Sequence[SheetView], order: int) -> tuple[Probe, list[SheetView]]:
    """The sheet without the blocks whose frequency is beyond an order, and views of what is left of it."""

    def kept(block: Block) -> bool:
        return block.frequency is None or bool(frequency_order(np.array(block.frequency)) <= order)

    chosen = np.array([kept(block) for block in field_blocks(probe)])
    return replace(probe, blocks=tuple(filter(kept, probe.blocks))), [view.of_blocks(chosen) for view in views]
