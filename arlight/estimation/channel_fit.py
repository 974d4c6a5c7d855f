"""Robust weighted least squares of one colour channel: weights, blur and solution are refined together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.error_scale import next_scales, row_scale
from arlight.estimation.lamps import BesideLamps
from arlight.estimation.normal_equations import Beside, BlockSystem
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.robust_weights import block_weights
from arlight.estimation.row_noise import RowNoise, row_noise
from arlight.estimation.sheet_match import unexplained_share
from arlight.estimation.stripe_rows import usable_rows
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

_ITERATIONS = 4
_GAIN_DOUBT = 0.01
"""Relative error of all that a sheet measures: of the paper's reflectance, the film's and the glass's transmittance."""
_SPARKLE = 0.0008
"""Usual standard deviation of what a block mirrors beside the smooth field, relative to white."""
_EXTRA_TO_SHADING = 0.5
"""What a block mirrors beside the smooth field, relative to how uneven the block is: a lamp's halo has a slope."""
_EVEN = 0.005
"""Slope that noise and codec give an even block, relative to white."""
_FIRST_SPARKLE = 0.02
"""Usual standard deviation in the first iteration, wide enough that no lamp pulls the solution before it is
recognised."""


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """Solution for one channel."""

    packed: Array
    """(2k - 1,) real-packed coefficients [radiance * sr]."""
    covariance: Array
    """Their covariance."""
    field: Array
    """(blocks,) smooth reflection field [full scale]."""
    reflection: Array
    """(blocks,) field plus what each block mirrors beside it, such as a lamp."""
    predicted: Array
    """(blocks, 7) rows that lighting and reflection predict, blur included."""
    chi2: float
    """Robust chi-square per row; nan when no row was usable."""
    unexplained: float
    """Share of the stripes that the fit does not explain, 0 to about 1; nan where too few blocks show clear stripes."""
    nuisance: Nuisance
    """Blur and lower face at which the stripes fit best."""


def fit_channel(
    means: BlockMeans,
    channel: int,
    white: float,
    rows: Array,
    lower: Array,
    mean_model: Array,
    system: BlockSystem,
    nuisance: Nuisance,
) -> ChannelFit:
    """Fit one channel.

    Args:
        means: the frame's measurements.
        channel: 0, 1, 2 for red, green, blue.
        white: radiance of clear film on white paper.
        rows: (blocks, 7, 3) response before blur; lower: (blocks, 7) what the lower face mirrors where the upper
            face mirrors 1.
        mean_model: (blocks,) error of the model in the means, relative to white.
        system: gathers and solves the normal equations.
        nuisance: first guess.
    """
    task = _Task.of(means, channel, white, rows, lower, mean_model, system, nuisance)
    lamp = np.maximum(task.ordinary, (_FIRST_SPARKLE * white) ** 2)
    weights = np.ones(len(rows))
    for _ in range(_ITERATIONS):
        done = task.iterate(nuisance, lamp, weights)
        nuisance, lamp, weights = done.nuisance, done.lamp, done.weights
    predicted = task.values - done.residual
    unexplained = unexplained_share(means, channel, white, predicted, done.model.transfer)
    return task.finished(done, predicted, unexplained)


@dataclass(frozen=True, slots=True)
class _Iteration:
    """One solution, and what the next one starts from."""

    model: "_Model"
    """The rows' model that was solved for."""
    precision: Array
    """(blocks, 7, 7) of the rows beside lamps."""
    solution: Array
    """Coefficients and reflection field."""
    normal: Array
    """Their normal matrix."""
    field: Array
    """(blocks,) smooth reflection field."""
    extra: Array
    """(blocks,) what each block mirrors beside it."""
    missed: Array
    """(blocks, 7) measured less lighting and field."""
    residual: Array
    """(blocks, 7) the same less the extras."""
    squared: Array
    """(blocks, 7) residuals, squared, relative to their variances."""
    beside: Beside
    """Equations of the nuisance."""
    nuisance: Nuisance
    """Blur, shift and lower face for the next iteration."""
    doubt: Array
    """(5, 5) their covariance."""
    lamp: Array
    """(blocks,) variance to grant the extras in the next iteration."""
    weights: Array
    """(blocks,) weights of the blocks in the next iteration."""


@dataclass(frozen=True, slots=True)
class _Task:
    """What stays the same while weights, blur and solution are refined."""

    means: BlockMeans
    """The frame's measurements."""
    channel: int
    """0, 1, 2 for red, green, blue."""
    rows: Array
    """(blocks, 7, 3) response before blur."""
    lower: Array
    """(blocks, 7) what the lower face mirrors where the upper face mirrors 1."""
    system: BlockSystem
    """Gathers and solves the normal equations."""
    noise: RowNoise
    """Errors to expect of the rows."""
    known_scale: tuple[float, float]
    """Variance of the model's errors in means and harmonics, relative to the usual, as earlier frames have it."""
    sparkle: float
    """Usual variance of what a block mirrors beside the smooth field."""
    ordinary: Array
    """(blocks,) the same with what the block's shading tells of it."""

    @classmethod
    def of(
        cls, means: BlockMeans, channel: int, white: float, rows: Array, lower: Array, mean_model: Array,
        system: BlockSystem, nuisance: Nuisance,
    ) -> "_Task":  # fmt: skip
        """Arguments as of `fit_channel`."""
        noise = row_noise(means, channel, white, mean_model, nuisance.transfer(means.cycles_per_px))
        known_scale = nuisance.error_scale[channel]
        uneven = np.maximum(means.shading[:, channel] - _EVEN * white, 0.0)
        sparkle = (_SPARKLE * white) ** 2
        ordinary = known_scale[0] * sparkle + (_EXTRA_TO_SHADING * uneven) ** 2
        return cls(means, channel, rows, lower, system, noise, known_scale, sparkle, ordinary)

    @property
    def values(self) -> Array:
        """(blocks, 7) what was measured."""
        return self.means.values[:, :, self.channel]

    def iterate(self, nuisance: Nuisance, lamp: Array, weights: Array) -> _Iteration:
        """Solve once, and refine what the solution was made with."""
        model = _Model.of(nuisance, self.means, self.rows, self.lower)
        scale = row_scale(self.known_scale)
        precision = self.noise.precision(scale, model.usable) * weights[:, None, None]
        lamps = BesideLamps.of(precision, model.mirror, lamp)
        solution, normal = self.system.solve(model.design, model.mirror, self.values, lamps.precision)
        field = self.system.field(solution)
        missed = self.values - self.system.lit(solution, model.design) - model.mirror * field[:, None]
        extra = lamps.extra(missed)
        residual = missed - model.mirror * extra[:, None]
        squared = residual**2 / self.noise.residual_variance(scale)
        # only what stands out of the noise can tell how the lower face mirrors it
        mirrored = field + extra**3 / np.maximum(extra**2 + lamps.spread, 1e-30)
        cycles = self.means.cycles_per_px
        slopes = nuisance.slopes(self.values - residual, model.face * mirrored[:, None], cycles)
        beside = self.system.beside(normal, model.design, model.mirror, lamps.precision, slopes, missed)
        stepped, doubt = nuisance.stepped(beside.information, beside.right)
        return _Iteration(
            model, lamps.precision, solution, normal, field, extra, missed, residual, squared, beside, stepped, doubt,
            lamps.granted(extra, self.ordinary), block_weights(squared, model.usable),
        )  # fmt: skip

    def finished(self, done: _Iteration, predicted: Array, unexplained: float) -> ChannelFit:
        """The last solution, with how certain it is."""
        inverse = np.asarray(np.linalg.inv(done.normal), float)
        packed = done.solution[: len(done.solution) - self.system.field_size]
        squared, usable = done.weights[:, None] * done.squared, done.model.usable
        return ChannelFit(
            packed=packed,
            covariance=_covariance(packed, inverse + done.beside.carried @ done.doubt @ done.beside.carried.T),
            field=done.field,
            reflection=done.field + done.extra,
            predicted=predicted,
            chi2=float(np.mean(squared[usable])) if np.any(usable) else float("nan"),
            unexplained=unexplained,
            nuisance=done.nuisance.rescaled(self.channel, self._scales(done, inverse)),
        )

    def _scales(self, done: _Iteration, inverse: Array) -> tuple[float, float]:
        """Variance of the model's errors in means and harmonics for the next frame, by this one's residuals."""
        model = done.model
        left = done.precision - self.system.explained(inverse, model.design, model.mirror, done.precision)
        pull = np.einsum("brs,bs->br", done.precision, done.missed)
        mean, swing = next_scales(self.known_scale, self.noise, self.sparkle, self.ordinary, model.usable, pull, left)
        return (mean, swing) if self.noise.whole else (max(mean, 1.0), max(swing, 1.0))


@dataclass(frozen=True, slots=True)
class _Model:
    """The rows' model at one blur and shift."""

    transfer: Array
    """(blocks, 7) what blur leaves."""
    design: Array
    """(blocks, 7, c) response to the coefficients."""
    face: Array
    """(blocks, 7) what the lower face mirrors if it is as strong as Fresnel's."""
    mirror: Array
    """(blocks, 7) what both faces mirror."""
    usable: NDArray[np.bool_]
    """(blocks, 7) rows that were measured and that blur has left."""

    @classmethod
    def of(cls, nuisance: Nuisance, means: BlockMeans, rows: Array, lower: Array) -> "_Model":
        transfer = nuisance.transfer(means.cycles_per_px)
        face = nuisance.shifted(lower * transfer, means.cycles_per_px)
        mirror = nuisance.lower_face * face
        mirror[:, 0] += 1.0
        design = nuisance.shifted(rows * transfer[..., None], means.cycles_per_px)
        return cls(transfer, design, face, mirror, usable_rows(means, transfer))


def _covariance(packed: Array, of_all: Array) -> Array:
    """Covariance of the coefficients, out of that of all unknowns: what scales the whole measurement is added."""
    size = len(packed)
    return np.asarray(of_all[:size, :size] + _GAIN_DOUBT**2 * np.outer(packed, packed), float)
