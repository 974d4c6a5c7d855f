"""How much the rows of a view count while the layers are fitted under unknown light."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layers.sheet_blocks import SheetBlocks
from arlight.calibration.layers.sheet_view import SheetView
from arlight.calibration.layers.view_rows import GREEN, ViewRows
from arlight.estimation.lamps import BesideLamps
from arlight.estimation.robust_weights import block_weights
from arlight.estimation.row_noise import row_variance
from arlight.estimation.stripe_rows import usable_rows

Array = NDArray[np.float64]

_LAMP_STDDEV = 0.001
"""Usual standard deviation of what a block mirrors beside the smooth field, relative to white."""
_LAMP_TO_SHADING = 0.5
"""The same, relative to how uneven the block is."""
_FIRST_LAMP_STDDEV = 0.02
"""Usual standard deviation in the first iteration, wide enough that no lamp pulls the solution before it is
recognised."""


@dataclass(frozen=True, slots=True, eq=False)
class ViewWeights:
    """Precision of a view's rows, by the residuals that they have."""

    precision: Array
    """(blocks, 7, 7) matrices, lamps marginalised."""
    lamp: Array
    """(blocks,) variance granted to what each block mirrors beside the smooth field; the next iteration starts here."""
    chi2: float
    """Robust chi-square a usable row."""

    @classmethod
    def of(
        cls, view: SheetView, blocks: SheetBlocks, rows: ViewRows, level: float, lamp: Array | None
    ) -> "ViewWeights":
        """Weigh.

        Args:
            level: radiance of white in the view.
            lamp: as the last iteration had it; None in the first.
        """
        variance = row_variance(view.means, GREEN, level, blocks.mean_model)
        usable = usable_rows(view.means, rows.transfer)
        precision = np.where(usable, 1.0 / variance, 0.0)
        ordinary = (_LAMP_STDDEV * level) ** 2 + (_LAMP_TO_SHADING * view.means.shading[:, GREEN]) ** 2
        if lamp is None:
            lamp = np.maximum(ordinary, (_FIRST_LAMP_STDDEV * level) ** 2)
        lamps = BesideLamps.of(precision, rows.mirror, lamp)
        extra = lamps.extra(rows.residual)
        squared = (rows.residual - rows.mirror * extra[:, None]) ** 2 / variance
        weights = block_weights(squared, usable)[:, None]
        granted = lamps.granted(extra, ordinary)
        return cls(
            BesideLamps.of(precision * weights, rows.mirror, granted).precision,
            granted,
            float(np.sum((weights * squared)[usable])) / max(int(np.count_nonzero(usable)), 1),
        )
