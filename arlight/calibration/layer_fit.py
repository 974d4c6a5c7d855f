"""Robust separable least squares for the layers of a sheet from several views of it under unknown or known light.

Gauss-Newton on all unknown together. What belongs to one view alone (mirror reflection, blur, exposure) is eliminated
from the normal equations view by view, so the cost grows with the number of views; what is left are the layers'
parameters and the lights, and the inverse of their normal matrix is their covariance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layer_parameters import EXPECTED, HIGH, LOW, NAMES, STDDEV, STEP, assembly_of
from arlight.calibration.sheet_view import PredictedSheet, SheetView
from arlight.estimation.channel_fit import _block_weights, _next_lamps, _without_lamps
from arlight.estimation.prior import prior_stddev
from arlight.estimation.reflection import field_amplitude, reflection_basis
from arlight.estimation.response import optical_transfer
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL, row_variance
from arlight.fourier import frequency_order
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import HARMONICS

Array = NDArray[np.float64]
KnownLight = Callable[[Assembly], Array]
"""Real-packed coefficients (2k - 1,) at the frequencies that an assembled sheet measures."""

_GREEN = 1
_BLUR_STDDEV_PX2 = 0.3
_EXPOSURE_STDDEV = 0.2
_LAMP_STDDEV = 0.001
_LAMP_TO_SHADING = 0.5
_WEAKEST_TRANSFER = 0.12
_SETTLED = 0.1
"""Gauss-Newton stops when no parameter moves by more than this share of its standard deviation."""
_LAYERS = NAMES.index("vignetting_k1")
"""The parameters before this one change the response and are differentiated numerically."""


@dataclass(slots=True)
class _ViewState:
    """What is solved for one view alone."""

    reflection: Array
    blur_px2: float
    log_exposure: float = 0.0
    lamp: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True)
class LayerSolution:
    """Result of a fit."""

    vector: Array
    """(p,) the parameters, in the order of `NAMES`."""
    covariance: Array
    """(p, p) their covariance."""
    lights: list[Array]
    """Real-packed coefficients (2k - 1,) of each light at the measured frequencies, green."""
    chi2: float
    """Robust chi-square a usable row; 1 when the errors are as assumed."""


class LayerFit:
    """Views of one sheet under one or several lights, and the fit of its layers to them."""

    def __init__(self, probe: Probe, views: Sequence[SheetView], lights: Sequence[KnownLight | None] = (None,)) -> None:
        """Prepare.

        Args:
            views: measurements; each says which of the lights shone.
            lights: for each light its coefficients if they are known, else None.
        """
        blocks = field_blocks(probe)
        self._probe, self._views, self._known = probe, list(views), list(lights)
        self._centers = np.array([block.center_mm for block in blocks], float)
        self._order = np.array([frequency_order(block.frequency) if block.frequency else 0 for block in blocks])
        self._white = np.array([block.kind == "clear_white" for block in blocks])
        self._black = np.array([block.kind in ("clear_black", "black_white", "black_black") for block in blocks])
        self._mean_model = np.where(self._white, WHITE_MODEL, MEAN_MODEL)
        self._basis = reflection_basis(self._centers)
        self._size = 2 * len(probe.frequencies) - 1
        self._levels = [self._white_level(view) for view in self._views]

    def solve(self, vector: Array, order: int, iterations: int = 8) -> LayerSolution:
        """Fit, starting from a vector of parameters, with the blocks up to an order.

        Lights that are not known start from nothing: the first iteration finds them.
        """
        states = [_ViewState(np.zeros(self._basis.shape[1]), view.blur_px**2) for view in self._views]
        lights = [np.zeros(self._size) for _ in self._known]
        for iteration in range(iterations):
            normal, right, chi2 = self._normal_equations(vector, lights, states, order)
            inverse = np.linalg.inv(normal)
            change = inverse @ right
            shared = len(vector)
            step = change[:shared]
            if iteration == 0:
                # without light nothing is known of the layers yet
                step = np.zeros(shared) if any(known is None for known in self._known) else step
            self._update_views(change, states)
            # a step of the prior's size is as far as the linearised model can be believed
            vector = np.clip(vector + np.clip(step, -STDDEV, STDDEV), LOW, HIGH)
            for index, known in enumerate(self._known):
                begin = shared + index * self._size
                lights[index] = known(assembly_of(vector)) if known else lights[index] + change[begin:][: self._size]
            deviation = np.sqrt(np.diagonal(inverse)[:shared])
            if iteration > 1 and np.all(np.abs(step) < _SETTLED * deviation):
                break
        return LayerSolution(vector, np.asarray(inverse[:shared, :shared], float), lights, chi2)

    def _normal_equations(
        self, vector: Array, lights: list[Array], states: list[_ViewState], order: int
    ) -> tuple[Array, Array, float]:
        sheets = self._sheets(vector)
        total = len(vector) + self._size * len(lights)
        normal, right = np.zeros((total, total)), np.zeros(total)
        normal[np.diag_indices(len(vector))] = 1.0 / STDDEV**2
        right[: len(vector)] = (EXPECTED - vector) / STDDEV**2
        self._add_light_priors(normal, right, lights)
        self._eliminated: list[tuple[Array, Array]] = []
        chi2 = []
        for view, state, level in zip(self._views, states, self._levels, strict=True):
            rows = _ViewRows(self, view, state, vector, lights, sheets)
            chi2.append(rows.weigh(level, order, state))
            self._add_view(normal, right, rows, level, state)
        return normal, right, float(np.mean(chi2))

    def _sheets(self, vector: Array) -> list[PredictedSheet]:
        """The sheet as it is, again without its glass's echoes, and one with each layer parameter a step further.

        What the parameters change in the echoes is far below what the derivatives need.
        """
        steps = np.vstack([np.zeros(len(vector)), np.diag(STEP)[:_LAYERS]])
        stepped = [PredictedSheet(self._probe, assembly_of(vector + step), echoes=False) for step in steps]
        return [PredictedSheet(self._probe, assembly_of(vector)), *stepped]

    def _add_light_priors(self, normal: Array, right: Array, lights: list[Array]) -> None:
        for index, light in enumerate(lights):
            begin = len(normal) - self._size * (len(lights) - index)
            seen = [level for view, level in zip(self._views, self._levels, strict=True) if view.light == index]
            gain = self._probe.paper_reflectance * self._probe.film_transmittance**2 / np.pi
            spread = prior_stddev(self._probe.frequencies, float(np.median(seen or [1.0])) / gain)
            if self._known[index] is not None:
                spread = np.full(self._size, 1e-9)
                light = np.zeros(self._size)
            place = np.arange(begin, begin + self._size)
            normal[place, place] += 1.0 / spread**2
            right[place] -= light / spread**2

    def _add_view(self, normal: Array, right: Array, rows: "_ViewRows", level: float, state: _ViewState) -> None:
        weighted = rows.precision @ rows.shared
        local_weighted = rows.precision @ rows.local
        shared, local = (a.reshape(-1, a.shape[2]) for a in (rows.shared, rows.local))
        weighted, local_weighted = (a.reshape(-1, a.shape[2]) for a in (weighted, local_weighted))
        residual = rows.residual.ravel()
        own = local.T @ local_weighted
        spread, value = self._local_prior(rows.view, level, state)
        own[np.diag_indices_from(own)] += 1.0 / spread**2
        own_right = local_weighted.T @ residual - value / spread**2
        cross = weighted.T @ local
        solved = np.linalg.solve(own, np.column_stack([cross.T, own_right]))
        place = np.concatenate([np.arange(len(STEP)), rows.light_place])
        normal[np.ix_(place, place)] += shared.T @ weighted - cross @ solved[:, :-1]
        right[place] += weighted.T @ residual - cross @ solved[:, -1]
        everywhere = np.zeros((len(own), len(right)))
        everywhere[:, place] = solved[:, :-1]
        self._eliminated.append((everywhere, solved[:, -1]))

    def _local_prior(self, view: SheetView, level: float, state: _ViewState) -> tuple[Array, Array]:
        """Standard deviations of a view's own unknowns, and how far they are from what is expected."""
        black = self._black & view.means.valid
        amplitude = field_amplitude(view.means.values[black, 0, _GREEN], 1e-3 * level)
        spread = np.concatenate(
            [[level], np.full(self._basis.shape[1] - 1, amplitude), [_BLUR_STDDEV_PX2, _EXPOSURE_STDDEV]]
        )
        value = np.concatenate([state.reflection, [state.blur_px2 - view.blur_px**2, state.log_exposure]])
        return spread, value

    def _update_views(self, change: Array, states: list[_ViewState]) -> None:
        for state, (cross, own) in zip(states, self._eliminated, strict=True):
            step = own - cross @ change
            state.reflection = state.reflection + step[:-2]
            state.blur_px2 = float(np.clip(state.blur_px2 + step[-2], 0.0, 6.0))
            state.log_exposure += float(step[-1])

    def _white_level(self, view: SheetView) -> float:
        seen = view.means.values[self._white & view.means.valid, 0, _GREEN]
        return max(float(np.median(seen)), 1e-3) if len(seen) else 0.3


class _ViewRows:
    """One view's residual and its derivatives: what all views share, and what is the view's own."""

    def __init__(
        self,
        fit: LayerFit,
        view: SheetView,
        state: _ViewState,
        vector: Array,
        lights: list[Array],
        sheets: list[PredictedSheet],
    ) -> None:
        self.view, self._fit = view, fit
        p = dict(zip(NAMES, vector, strict=True))
        squared = view.radius_squared
        vignetting = 1.0 + squared * (p["vignetting_k1"] + squared * p["vignetting_k2"])
        plane = 1.0 + fit._centers / 100.0 @ np.array([p["gradient_x"], p["gradient_y"]])
        self.transfer = optical_transfer(view.means.cycles_per_px, state.blur_px2)
        gain = vignetting * plane * np.exp(state.log_exposure)
        scale = self.transfer * gain[:, None]
        light = lights[view.light]
        rows, lower = sheets[0].rows(view, light / light[0] if light[0] > 0.0 else None)
        places = sheets[0].response.places
        unit = np.einsum("brk,bk->br", rows, light[places])
        lit = unit * scale
        reflection = fit._basis @ state.reflection
        self.mirror = p["lower_face"] * lower * self.transfer
        self.mirror[:, 0] += 1.0
        self.mirror *= vignetting[:, None]
        model = lit + self.mirror * reflection[:, None]
        self.residual = view.means.values[:, :, _GREEN] - model
        # columns
        shared = np.zeros((*lit.shape, len(vector) + fit._size))
        lit_by = [np.einsum("brk,bk->br", sheet.rows(view)[0], light[sheet.response.places]) for sheet in sheets[1:]]
        for i in range(_LAYERS):
            shared[:, :, i] = (lit_by[i + 1] - lit_by[0]) / STEP[i]
        shared[:, :, :_LAYERS] *= scale[..., None]
        over = model / vignetting[:, None]
        shared[:, :, NAMES.index("vignetting_k1")] = over * squared[:, None]
        shared[:, :, NAMES.index("vignetting_k2")] = over * squared[:, None] ** 2
        shared[:, :, NAMES.index("lower_face")] = lower * self.transfer * (vignetting * reflection)[:, None]
        for axis, name in enumerate(("gradient_x", "gradient_y")):
            shared[:, :, NAMES.index(name)] = lit * (fit._centers[:, axis] / 100.0 / plane)[:, None]
        scaled = rows * scale[..., None]
        blocks = np.arange(len(places))
        for column in range(places.shape[1]):
            shared[blocks, :, len(vector) + places[:, column]] += scaled[:, :, column]
        self.shared = shared
        self.light_place = len(vector) + view.light * fit._size + np.arange(fit._size)
        order = np.concatenate([[0.0], np.repeat(np.arange(1.0, HARMONICS + 1), 2)])
        cycles = np.sum(view.means.cycles_per_px**2, axis=1)
        blur = -2.0 * np.pi**2 * cycles[:, None] * order**2 * lit
        self.local = np.concatenate(
            [self.mirror[..., None] * fit._basis[:, None, :], blur[..., None], lit[..., None]], axis=2
        )
        self.precision = np.zeros((*lit.shape, lit.shape[1]))

    def weigh(self, level: float, order: int, state: _ViewState) -> float:
        """Precision matrices by the residuals; returns the robust chi-square a usable row."""
        fit, means = self._fit, self.view.means
        variance = row_variance(means, _GREEN, level, fit._mean_model)
        harmonic = np.repeat(np.arange(1, HARMONICS + 1), 2)
        usable = np.ones(variance.shape, bool)
        usable[:, 1:] = (harmonic <= means.harmonics[:, None]) & (self.transfer[:, 1:] > _WEAKEST_TRANSFER)
        usable &= (means.valid & (fit._order <= order))[:, None]
        precision = np.where(usable, 1.0 / variance, 0.0)
        uneven = means.shading[:, _GREEN]
        ordinary = (_LAMP_STDDEV * level) ** 2 + (_LAMP_TO_SHADING * uneven) ** 2
        if not len(state.lamp):
            state.lamp = np.maximum(ordinary, (0.02 * level) ** 2)
        extra, state.lamp = _next_lamps(self.residual, precision, self.mirror, state.lamp, ordinary)
        left = self.residual - self.mirror * extra[:, None]
        squared = left**2 / variance
        weights = _block_weights(squared, usable)[:, None]
        self.precision = _without_lamps(precision * weights, self.mirror, state.lamp)
        return float(np.sum((weights * squared)[usable]) / max(np.count_nonzero(usable), 1))
