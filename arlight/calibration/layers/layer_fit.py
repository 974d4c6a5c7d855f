"""Robust separable least squares for the layers of a sheet from several views of it under constant, unknown light.

Gauss-Newton on all unknown together: the layers' parameters and the light, which all views share, and each view's
mirror reflection, blur and exposure.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layers.eliminated_equations import EliminatedEquations
from arlight.calibration.layers.layer_parameters import EXPECTED, HIGH, LOW, STDDEV
from arlight.calibration.layers.sheet_blocks import SheetBlocks
from arlight.calibration.layers.sheet_view import SheetView
from arlight.calibration.layers.view_rows import GREEN, TrialSheet, ViewRows, ViewUnknowns
from arlight.calibration.layers.view_weights import ViewWeights
from arlight.estimation.prior import prior_stddev
from arlight.estimation.reflection import field_amplitude
from arlight.probe.design import Probe

Array = NDArray[np.float64]

_BLUR_STDDEV_PX2 = 0.3
"""How far a view's blur may be from what the fiducials say [px^2]."""
_EXPOSURE_STDDEV = 0.2
"""Prior spread of the logarithm of a view's exposure."""
_FIELD_FLOOR = 1e-3
"""Least standard deviation of the reflection field, relative to white."""
_LEAST_WHITE, _UNSEEN_WHITE = 1e-3, 0.3
_ITERATIONS = 8
SETTLED = 0.1
"""Gauss-Newton stops when no parameter moves by more than this share of its standard deviation."""


@dataclass(frozen=True, slots=True, eq=False)
class LayerSolution:
    """Result of a fit."""

    vector: Array
    """(p,) the parameters, in the order of `NAMES`."""
    covariance: Array
    """(p, p) their covariance."""
    light: Array
    """(2k - 1,) real-packed coefficients of the light at the measured frequencies, green."""
    chi2: float
    """Robust chi-square a usable row; 1 when the errors are as assumed."""


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Everything that is unknown, at some iteration."""

    vector: Array
    """(p,) the parameters."""
    light: Array
    """(2k - 1,) the light."""
    views: list[ViewUnknowns]
    """What is each view's own."""
    lamps: list[Array | None]
    """(blocks,) variance granted to lamps mirrored in each view."""


class LayerFit:
    """Views of one sheet under one light, and the fit of its layers to them."""

    def __init__(self, probe: Probe, views: Sequence[SheetView]) -> None:
        """Prepare for measurements of the sheet's blocks."""
        self._probe, self._views = probe, list(views)
        self._blocks = SheetBlocks.of(probe)
        self._levels = [_white_level(view, self._blocks) for view in self._views]

    def solve(self, vector: Array, settled: float = SETTLED) -> LayerSolution:
        """Fit.

        Args:
            vector: (p,) where the parameters start. The light starts from nothing: the first iteration finds it.
            settled: when to stop, as `SETTLED`.
        """
        size = self._blocks.basis.shape[1]
        state = _State(
            vector,
            np.zeros(2 * len(self._probe.frequencies) - 1),
            [ViewUnknowns(np.zeros(size), view.blur_px**2) for view in self._views],
            [None] * len(self._views),
        )
        for iteration in range(_ITERATIONS):
            equations, lamps, chi2 = self._equations(state)
            change, covariance = equations.solve()
            covariance = covariance[: len(vector), : len(vector)]
            step = change[: len(vector)]
            state = _moved(state, change, equations, lamps, with_layers=iteration > 0)
            if iteration > 1 and np.all(np.abs(step) < settled * np.sqrt(np.diagonal(covariance))):
                break
        return LayerSolution(state.vector, covariance, state.light, chi2)

    def _equations(self, state: _State) -> tuple[EliminatedEquations, list[Array | None], float]:
        """Equations about a state, the variances that they grant to lamps, and chi-square a row."""
        trial = TrialSheet(self._probe, state.vector, state.light)
        spread = np.concatenate([STDDEV, self._light_spread()])
        equations = EliminatedEquations(spread, np.concatenate([state.vector - EXPECTED, state.light]))
        lamps: list[Array | None] = []
        chi2 = []
        for view, unknowns, lamp, level in zip(self._views, state.views, state.lamps, self._levels, strict=True):
            rows = ViewRows.of(view, self._blocks, trial, state.vector, unknowns)
            weights = ViewWeights.of(view, self._blocks, rows, level, lamp)
            own_spread = self._own_spread(view, level)
            away = np.append(unknowns.reflection, [unknowns.blur_px2 - view.blur_px**2, unknowns.log_exposure])
            equations.add(rows.residual, rows.shared, rows.own, weights.precision, own_spread, away)
            lamps.append(weights.lamp)
            chi2.append(weights.chi2)
        return equations, lamps, float(np.mean(chi2))

    def _light_spread(self) -> Array:
        """(2k - 1,) prior standard deviation of the light's coefficients."""
        white_per_irradiance = self._probe.paper_reflectance * self._probe.film_transmittance**2 / np.pi
        return prior_stddev(self._probe.frequencies, float(np.median(self._levels)) / white_per_irradiance)

    def _own_spread(self, view: SheetView, level: float) -> Array:
        """(s + 2,) prior standard deviations of a view's own unknowns."""
        black = self._blocks.black & view.means.valid
        amplitude = field_amplitude(view.means.values[black, 0, GREEN], _FIELD_FLOOR * level)
        field = np.full(self._blocks.basis.shape[1], amplitude)
        field[0] = level
        return np.append(field, [_BLUR_STDDEV_PX2, _EXPOSURE_STDDEV])


def _moved(
    state: _State, change: Array, equations: EliminatedEquations, lamps: list[Array | None], *, with_layers: bool
) -> _State:
    """The state after a step; without light nothing is known of the layers yet, and they stay where they are."""
    count = len(state.vector)
    vector = state.vector
    if with_layers:
        # a step of the prior's size is as far as the linearised model can be believed
        vector = np.clip(vector + np.clip(change[:count], -STDDEV, STDDEV), LOW, HIGH)
    own = [view.moved(step) for view, step in zip(state.views, equations.own_steps(change), strict=True)]
    return _State(vector, state.light + change[count:], own, lamps)


def _white_level(view: SheetView, blocks: SheetBlocks) -> float:
    """Radiance of clear film on white paper in a view."""
    seen = view.means.values[blocks.white & view.means.valid, 0, GREEN]
    return max(float(np.median(seen)), _LEAST_WHITE) if len(seen) else _UNSEEN_WHITE
