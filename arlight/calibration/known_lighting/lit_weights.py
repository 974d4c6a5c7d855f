"""How much each measured row counts: noise, the model's own error, lamps mirrored in the film, what hides a block."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.lit_views import LitView
from arlight.calibration.known_lighting.sheet_model import ViewPrediction
from arlight.estimation.lamps import BesideLamps
from arlight.estimation.response import optical_transfer
from arlight.estimation.robust_weights import block_weights, harmonic_squares
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL, row_variance
from arlight.estimation.stripe_rows import usable_rows

Array = NDArray[np.float64]

_FREEDOM = 4.0
"""Degrees of freedom of the Student-t distribution of a block's harmonics."""
_SPARKLE = 0.0008
"""Usual error of the predicted mirror reflection, relative to white."""
_OF_PREDICTED = 0.15
"""The same, relative to the reflection: the environment is coarse, and the camera hides a part of it."""
_TO_SHADING = 0.5
"""The same, relative to how uneven the block is."""
_EVEN = 0.005
"""Slope that noise and codec give an even block, relative to white."""


@dataclass(frozen=True, slots=True)
class WeightedView:
    """Residuals of a view with the precision matrices of their errors."""

    residual: Array
    """(blocks, 7, 3) measured less predicted."""
    precision: Array
    """(3, blocks, 7, 7) with an unknown mirrored extra in every block marginalised."""
    squared: Array
    """(blocks, 3) normalised squared residual of a block's harmonics, and
    of its mean where no reflection disturbs it, per row."""


@dataclass(frozen=True, slots=True)
class RowModel:
    """What weighs rows, apart from the measurements."""

    white: NDArray[np.bool_]
    """(blocks,) clear film on white paper."""
    order: NDArray[np.int64]
    """(blocks,) order of each block's frequency, 0 without pattern."""
    tolerance: float = 0.0
    """Extra standard deviation of every row, relative to white, while the layers are still far off."""
    highest_order: int = 8
    """Highest order whose stripes are used: coarse ones first, whose phase cannot be off by a cycle."""

    def weigh(self, view: LitView, prediction: ViewPrediction, blur_variance_px2: float) -> WeightedView:
        """Residuals and precision of a view's rows."""
        means = view.sheet.means
        residual = means.values - prediction.rows
        transfer = optical_transfer(means.cycles_per_px, blur_variance_px2)
        usable = self._usable(view, transfer)
        precision = np.zeros((3, *transfer.shape, transfer.shape[1]))
        squared = np.zeros((len(residual), 3))
        mean_model = np.where(self.white, WHITE_MODEL, MEAN_MODEL)
        level = white_level(view, self.white)
        for channel in range(3):
            variance = row_variance(means, channel, float(level[channel]), mean_model)
            variance = variance + (self.tolerance * level[channel]) ** 2
            extra = self._extra(view, prediction, channel, float(level[channel]))
            relative = residual[..., channel] ** 2 / variance
            total, count = harmonic_squares(relative, usable)
            squared[:, channel] = total / np.maximum(count, 1)
            weight = block_weights(relative, usable, _FREEDOM)
            rows = np.where(usable, weight[:, None] / variance, 0.0)
            precision[channel] = BesideLamps.of(rows, prediction.mirror, extra).precision
        return WeightedView(residual, precision, squared)

    def _usable(self, view: LitView, transfer: Array) -> NDArray[np.bool_]:
        return usable_rows(view.sheet.means, transfer) & (self.order <= self.highest_order)[:, None]

    def _extra(self, view: LitView, prediction: ViewPrediction, channel: int, level: float) -> Array:
        """(blocks,) variance of what a block mirrors beside the prediction; wider where the mean shows a lamp."""
        uneven = np.maximum(view.sheet.means.shading[:, channel] - _EVEN * level, 0.0)
        usual = (_SPARKLE * level) ** 2 + (_TO_SHADING * uneven) ** 2
        usual = usual + (_OF_PREDICTED * prediction.mirrored[:, channel]) ** 2
        mean = view.sheet.means.values[:, 0, channel] - prediction.rows[:, 0, channel]
        strayed = np.maximum(np.abs(mean) - 0.02 * level - self.tolerance * level, 0.0)
        return np.asarray(usual + strayed**2, float)


def white_level(view: LitView, white: NDArray[np.bool_]) -> Array:
    """(3,) radiance of clear film on white paper; from all blocks where no white is seen."""
    means = view.sheet.means
    seen = means.values[white & means.valid, 0]
    if len(seen):
        return np.asarray(np.maximum(np.median(seen, axis=0), 1e-3), float)
    every = means.values[means.valid, 0]
    return np.asarray(np.maximum(8.0 * np.median(every, axis=0), 1e-3), float) if len(every) else np.full(3, 0.5)
