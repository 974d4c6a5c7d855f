"""Robust Gauss-Newton over layers, blocks, views and exposures together, every unknown with a normal prior.

The lights are known, so nothing of them is solved for. Stripes of low orders lead, for a layer that lies half a
millimetre aside puts the finest stripes off by more than half a cycle.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.block_corrections import MODEL, CorrectionPrior, learnt_prior
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.known_lighting.lit_views import LitView
from arlight.calibration.known_lighting.lit_weights import RowModel
from arlight.calibration.known_lighting.sheet_model import (
    EXPECTED,
    LAYER_STDDEV,
    LOW,
    NAMES,
    VIEW_STDDEV,
    Linearisation,
    Unknowns,
)
from arlight.probe.design import Probe

Array = NDArray[np.float64]

EXPOSURE_STDDEV = 1.0
"""Prior spread of an unknown exposure factor."""
_BLUR_HIGH_PX2 = 8.0
_LONGEST_STEP = 1.5
"""Steps are cut to this many prior standard deviations of the layers."""


@dataclass(frozen=True, slots=True)
class Places:
    """Where the unknowns stand in the vector that is solved for."""

    layers: int
    """How many parameters of the layers, the vector's first."""
    lightings: int
    """How many lightings, three exposures each; 0 where exposures are known."""
    views: int
    """How many views."""
    blocks: int
    """How many blocks, the vector's last."""

    @property
    def size(self) -> int:
        """Length of the vector."""
        return self.first_block + 4 * self.blocks

    @property
    def first_block(self) -> int:
        """Place of the first block's corrections."""
        return self.layers + 3 * self.lightings + len(VIEW_STDDEV) * self.views

    def exposure(self, lighting: int) -> slice:
        """Places of a lighting's exposures."""
        return slice(self.layers + 3 * lighting, self.layers + 3 * lighting + 3)

    def view(self, number: int) -> slice:
        """Places of a view's unknowns."""
        first = self.layers + 3 * self.lightings + len(VIEW_STDDEV) * number
        return slice(first, first + len(VIEW_STDDEV))


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal equations about a trial, lighting by lighting, so that any of them can be left out."""

    matrices: Array
    """(lightings, u, u) of the views of each lighting."""
    right: Array
    """(lightings, u) right-hand sides."""
    prior: Array
    """(u,) inverse variances."""
    pull: Array
    """(u,) prior's right-hand side."""
    squared: Array
    """(views, blocks) mean normalised squared residual of the stripes."""
    views: NDArray[np.int64]
    """(lightings,) how many views each lighting has."""

    def solve(self, without: int | None = None) -> tuple[Array, Array]:
        """Step (u,) and its covariance (u, u), without the views of one lighting where that is asked for."""
        kept = [i for i in range(len(self.matrices)) if i != without]
        # a view counts for more when there are fewer
        factor = np.sqrt(self.views.sum() / max(int(self.views[kept].sum()), 1))
        covariance = np.linalg.inv(factor * self.matrices[kept].sum(axis=0) + np.diag(self.prior))
        return covariance @ (factor * self.right[kept].sum(axis=0) + self.pull), covariance


class KnownLightingFit:
    """Fits a sheet to views under known light."""

    def __init__(
        self, probe: Probe, lights: Sequence[KnownLight], rows: RowModel, prior: CorrectionPrior, relative: bool
    ) -> None:
        """
        Args:
            probe: the sheet as designed.
            lights: the lights, by number.
            rows: how rows are weighed.
            prior: how far blocks stray from the layers' model.
            relative: whether every light's exposure is unknown, in each channel.
        """
        self._probe = probe
        self._lights = lights
        self._rows = rows
        self.prior = prior
        """How far blocks stray from the layers' model."""
        self._relative = relative
        self._widest = prior
        self._spread: Array | None = None
        self._block_variance: Array = np.zeros((0, len(MODEL)))

    def step(
        self, unknowns: Unknowns, views: list[LitView], highest_order: int, tolerance: float
    ) -> tuple[Unknowns, float]:
        """One step; returns the unknowns after it and its length in prior standard deviations of the layers."""
        normal = self.normal(unknowns, views, highest_order, tolerance)
        change, covariance = normal.solve()
        self._block_variance = np.diagonal(covariance)[-unknowns.blocks.size :].reshape(unknowns.blocks.shape)
        length = float(np.max(np.abs(change[: len(NAMES)]) / LAYER_STDDEV))
        return self.moved(unknowns, change * min(1.0, _LONGEST_STEP / max(length, 1e-12))), length

    def learn_prior(self, unknowns: Unknowns) -> None:
        """Take over how far this sheet's blocks stray from the model, after a step."""
        self.prior, self._spread = learnt_prior(self.prior, unknowns.blocks, self._block_variance, self._widest)

    def normal(
        self, unknowns: Unknowns, views: list[LitView], highest_order: int = 8, tolerance: float = 0.0
    ) -> Normal:
        """Normal equations about a trial."""
        places = self._places(unknowns)
        model = replace(self._rows, highest_order=highest_order, tolerance=tolerance)
        linear = Linearisation(self._probe, self._lights, unknowns)
        matrices = np.zeros((len(self._lights), places.size, places.size))
        right = np.zeros((len(self._lights), places.size))
        squared = np.zeros((len(views), len(unknowns.blocks)))
        # what codec and model get wrong repeats from view to view: views count for less than their number
        repeated = float(np.sqrt(len(views)))
        for number, view in enumerate(views):
            prediction = linear.predict(view, number)
            weighted = model.weigh(view, prediction, float(unknowns.views[number, 0]))
            squared[number] = weighted.squared.mean(axis=1)
            shared, single = linear.differences(view, number)
            at = np.r_[0 : places.layers, places.view(number)]
            for channel in range(3):
                design, index = shared[:, :, channel], at
                if self._relative:
                    slope = prediction.rows[:, :, channel, None] / unknowns.exposures[view.sheet.light, channel]
                    design = np.concatenate([design, slope], axis=2)
                    index = np.append(at, places.exposure(view.sheet.light).start + channel)
                _add(
                    matrices[view.sheet.light], right[view.sheet.light], places.first_block, index, design,
                    single[:, :, channel], weighted.precision[channel] / repeated, weighted.residual[..., channel],
                )  # fmt: skip
        inverse_variance, pull = self._priors(unknowns, views, places)
        count = np.bincount([view.sheet.light for view in views], minlength=len(self._lights))
        return Normal(matrices, right, inverse_variance, pull, squared, count)

    def moved(self, unknowns: Unknowns, change: Array) -> Unknowns:
        """The unknowns after a step (u,), within their limits."""
        places = self._places(unknowns)
        own = unknowns.views + change[places.view(0).start : places.first_block].reshape(unknowns.views.shape)
        own[:, 0] = np.clip(own[:, 0], 0.0, _BLUR_HIGH_PX2)
        exposures = unknowns.exposures
        if self._relative:
            factor = change[places.layers : places.view(0).start].reshape(exposures.shape)
            exposures = np.maximum(exposures + factor, 0.1 * exposures)
        return Unknowns(
            layers=np.maximum(unknowns.layers + change[: places.layers], LOW),
            blocks=unknowns.blocks + change[places.first_block :].reshape(unknowns.blocks.shape),
            views=own,
            exposures=exposures,
        )

    def _places(self, unknowns: Unknowns) -> Places:
        lightings = len(self._lights) if self._relative else 0
        return Places(len(NAMES), lightings, len(unknowns.views), len(unknowns.blocks))

    def _priors(self, unknowns: Unknowns, views: list[LitView], places: Places) -> tuple[Array, Array]:
        """Inverse variances (u,) and their pull toward the expected values."""
        usual = np.zeros_like(unknowns.views)
        usual[:, 0] = [view.sheet.blur_px**2 for view in views]
        away = [EXPECTED - unknowns.layers, (usual - unknowns.views).ravel(), (MODEL - unknowns.blocks).ravel()]
        blocks = np.tile(self.prior.stddev, places.blocks) if self._spread is None else self._spread.ravel()
        stddev = [LAYER_STDDEV, np.tile(VIEW_STDDEV, len(views)), blocks]
        if self._relative:
            # about the start, which the pictures gave: only a guard against lights that were never seen
            away.insert(1, np.zeros(3 * places.lightings))
            stddev.insert(1, EXPOSURE_STDDEV * unknowns.exposures.ravel())
        inverse = 1.0 / np.concatenate(stddev) ** 2
        return inverse, inverse * np.concatenate(away)


def _add(
    matrix: Array, right: Array, first_block: int, index: NDArray[np.int64], shared: Array, single: Array,
    precision: Array, residual: Array,
) -> None:  # fmt: skip
    """Add a view's channel: shared (blocks, 7, p) unknowns at `index`, four of each block's own after `first_block`."""
    blocks, _, own = single.shape
    weighted = precision @ np.concatenate([shared, single, residual[..., None]], axis=2)
    width = shared.shape[2]
    wide = np.swapaxes(shared, 1, 2) @ weighted
    matrix[np.ix_(index, index)] += wide[:, :, :width].sum(axis=0)
    right[index] += wide[:, :, -1].sum(axis=0)
    narrow = np.swapaxes(single, 1, 2) @ weighted[:, :, width:]
    cross = wide[:, :, width:-1]
    for block in range(blocks):
        place = slice(first_block + own * block, first_block + own * (block + 1))
        matrix[index, place] += cross[block]
        matrix[place, index] += cross[block].T
        matrix[place, place] += narrow[block, :, :own]
        right[place] += narrow[block, :, own]
