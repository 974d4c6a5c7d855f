"""One view's residual and its derivatives: with what all views share, and with what is the view's own.

A row is what light and stack give, blurred, under the gain of lens, lamp distance and exposure, and what both faces of
the glass mirror of a smooth field, under the lens's gain alone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layers.layer_parameters import NAMES, STEP, assembly_of
from arlight.calibration.layers.sheet_blocks import SheetBlocks
from arlight.calibration.layers.sheet_view import PredictedSheet, SheetView
from arlight.estimation.response import optical_transfer
from arlight.estimation.stripe_rows import HARMONIC_OF_ROW
from arlight.probe.design import Probe

Array = NDArray[np.float64]

GREEN = 1
"""The channel that is fitted: nearly luma, the sharpest of the three."""
_LAYERS = NAMES.index("vignetting_k1")
"""The parameters before this one change the response and are differentiated numerically."""
_BLUR_LOW_PX2, _BLUR_HIGH_PX2 = 0.0, 6.0


@dataclass(frozen=True, slots=True, eq=False)
class ViewUnknowns:
    """What is solved for one view alone."""

    reflection: Array
    """(s,) smooth field that the upper face mirrors, in the blocks' basis [full scale]."""
    blur_px2: float
    """Variance of the picture's blur [px^2]."""
    log_exposure: float = 0.0
    """Logarithm of the view's exposure, relative to the other views'."""

    def moved(self, step: Array) -> "ViewUnknowns":
        """The unknowns after a step (s + 2,)."""
        blur_px2 = float(np.clip(self.blur_px2 + step[-2], _BLUR_LOW_PX2, _BLUR_HIGH_PX2))
        return ViewUnknowns(self.reflection + step[:-2], blur_px2, self.log_exposure + float(step[-1]))


class TrialSheet:
    """A trial of the layers, and the sheets about it that tell how rows change with each parameter.

    What the parameters change in the echoes is far below what the derivatives need.
    """

    def __init__(self, probe: Probe, vector: Array, light: Array) -> None:
        """Solve the stacks.

        Args:
            probe: the sheet as designed.
            vector: (p,) the parameters.
            light: (2k - 1,) real-packed coefficients of the light at the measured frequencies, as far as known.
        """
        self._sheet = PredictedSheet(probe, assembly_of(vector))
        self._light = light
        self._stepped: list[PredictedSheet] = []
        if np.any(light):
            steps = np.vstack([np.zeros(len(vector)), np.diag(STEP)[:_LAYERS]])
            self._stepped = [PredictedSheet(probe, assembly_of(vector + step), echoes=False) for step in steps]
        self.places = self._sheet.response.places
        """(blocks, c) which coefficients the columns of `rows` belong to."""
        self.coefficients = len(light)
        """How many coefficients the light has."""

    def rows(self, view: SheetView) -> Array:
        """(blocks, 7, c) for unit coefficients, before blur."""
        return self._sheet.light(view, self._light / self._light[0] if self._light[0] > 0.0 else None)

    def lower_mirror(self, view: SheetView) -> Array:
        """(blocks, 7) what the lower face mirrors as strong as Fresnel's, where the upper face mirrors 1."""
        return self._sheet.lower_mirror(view)

    def lit(self, rows: Array) -> Array:
        """(blocks, 7) what the light gives."""
        return _lit(rows, self._light[self.places])

    def slopes(self, view: SheetView) -> Array:
        """(blocks, 7, p) how `lit` changes with the parameters of the layers; 0 for all others."""
        slopes = np.zeros((*self.places.shape[:1], len(HARMONIC_OF_ROW), len(NAMES)))
        if self._stepped:
            # dot gain gives the film a second harmonic, and its blocks further columns
            base, *stepped = (_lit(sheet.light(view), self._light[sheet.response.places]) for sheet in self._stepped)
            for column, lit in enumerate(stepped):
                slopes[:, :, column] = (lit - base) / STEP[column]
        return slopes


@dataclass(frozen=True, slots=True, eq=False)
class ViewRows:
    """What a trial predicts for one view, and how that changes."""

    transfer: Array
    """(blocks, 7) what blur leaves of the rows."""
    mirror: Array
    """(blocks, 7) rows of a field of 1 that both faces mirror."""
    residual: Array
    """(blocks, 7) measured less predicted."""
    shared: Array
    """(blocks, 7, p + 2k - 1) change with the parameters and the light."""
    own: Array
    """(blocks, 7, s + 2) change with the view's own unknowns."""

    @classmethod
    def of(
        cls, view: SheetView, blocks: SheetBlocks, trial: TrialSheet, vector: Array, unknowns: ViewUnknowns
    ) -> "ViewRows":
        """Predict and differentiate."""
        shown = _Shown.of(view, blocks, trial, vector, unknowns)
        return cls(
            transfer=shown.transfer,
            mirror=shown.mirror,
            residual=view.means.values[:, :, GREEN] - shown.model,
            shared=np.concatenate([_by_parameters(view, blocks, trial, shown), _by_light(trial, shown)], axis=2),
            own=_by_own(view, blocks, shown),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """The model of the rows, factor by factor."""

    transfer: Array
    """(blocks, 7) what blur leaves."""
    vignetting: Array
    """(blocks,) gain of the lens."""
    plane: Array
    """(blocks,) gain of light that is nearer to one side."""
    scale: Array
    """(blocks, 7) all that scales the lit rows."""
    rows: Array
    """(blocks, 7, c) for unit coefficients, before blur and gain."""
    lit: Array
    """(blocks, 7) what the light gives."""
    lower: Array
    """(blocks, 7) what a lower face as strong as Fresnel's mirrors of a field of 1."""
    mirror: Array
    """(blocks, 7) what both faces mirror of it."""
    field: Array
    """(blocks,) the field."""

    @property
    def model(self) -> Array:
        """(blocks, 7) predicted rows."""
        return np.asarray(self.lit + self.mirror * self.field[:, None], float)

    @classmethod
    def of(
        cls, view: SheetView, blocks: SheetBlocks, trial: TrialSheet, vector: Array, unknowns: ViewUnknowns
    ) -> "_Shown":
        p = dict(zip(NAMES, vector, strict=True))
        vignetting = 1.0 + view.radius_squared * (p["vignetting_k1"] + view.radius_squared * p["vignetting_k2"])
        plane = 1.0 + blocks.centers_mm / 100.0 @ np.array([p["gradient_x"], p["gradient_y"]])
        transfer = optical_transfer(view.means.cycles_per_px, unknowns.blur_px2)
        scale = transfer * (vignetting * plane * np.exp(unknowns.log_exposure))[:, None]
        rows = trial.rows(view)
        lower = trial.lower_mirror(view) * transfer * vignetting[:, None]
        mirror = p["lower_face"] * lower
        mirror[:, 0] += vignetting
        field = blocks.basis @ unknowns.reflection
        return cls(transfer, vignetting, plane, scale, rows, trial.lit(rows) * scale, lower, mirror, field)


def _lit(rows: Array, light: Array) -> Array:
    """(blocks, 7) rows under light (blocks, c)."""
    return np.asarray(np.einsum("brk,bk->br", rows, light), float)


def _by_parameters(view: SheetView, blocks: SheetBlocks, trial: TrialSheet, shown: _Shown) -> Array:
    slopes = trial.slopes(view) * shown.scale[..., None]
    of_lens = shown.model * (view.radius_squared / shown.vignetting)[:, None]
    slopes[:, :, NAMES.index("vignetting_k1")] = of_lens
    slopes[:, :, NAMES.index("vignetting_k2")] = of_lens * view.radius_squared[:, None]
    slopes[:, :, NAMES.index("lower_face")] = shown.lower * shown.field[:, None]
    for axis, name in enumerate(("gradient_x", "gradient_y")):
        slopes[:, :, NAMES.index(name)] = shown.lit * (blocks.centers_mm[:, axis] / 100.0 / shown.plane)[:, None]
    return slopes


def _by_light(trial: TrialSheet, shown: _Shown) -> Array:
    places = trial.places
    slopes = np.zeros((*shown.lit.shape, trial.coefficients))
    scaled = shown.rows * shown.scale[..., None]
    block = np.arange(len(places))
    for column in range(places.shape[1]):
        slopes[block, :, places[:, column]] += scaled[:, :, column]
    return slopes


def _by_own(view: SheetView, blocks: SheetBlocks, shown: _Shown) -> Array:
    cycles = np.sum(view.means.cycles_per_px**2, axis=1)
    blur = -2.0 * np.pi**2 * cycles[:, None] * HARMONIC_OF_ROW**2 * shown.lit
    field = shown.mirror[..., None] * blocks.basis[:, None, :]
    return np.concatenate([field, blur[..., None], shown.lit[..., None]], axis=2)
