"""Robust weighted least squares of one colour channel: weights, blur and solution are refined together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.error_scale import next_scales, row_scale
from arlight.estimation.normal_equations import BlockSystem
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.row_noise import row_noise
from arlight.estimation.sheet_match import unexplained_share
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

__all__ = ["ChannelFit", "Nuisance", "fit_channel"]

_ITERATIONS = 4
_FREEDOM = 8.0
"""Degrees of freedom of the Student-t distribution of a block's harmonics."""
_LAMP_FREEDOM = 4.0
"""The same of what blocks mirror beside the smooth field."""
_GAIN_DOUBT = 0.01
"""Relative error of all that a sheet measures: of the paper's reflectance, the film's and the glass's transmittance."""
_SPARKLE = 0.0008
"""Usual standard deviation of what a block mirrors beside the smooth field, relative to white."""
_EXTRA_TO_SHADING = 0.5
"""What a block mirrors beside the smooth field, relative to how uneven the block is: a lamp's halo has a slope."""
_EVEN = 0.005
"""Slope that noise and codec give an even block, relative to white."""
_FIRST_SPARKLE = 0.02
"""The same in the first iteration, wide enough that no lamp pulls the solution before it is recognised."""
_WEAKEST_TRANSFER = 0.12
"""Harmonics that blur has taken below this share are not used."""


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
    values = means.values[:, :, channel]
    noise = row_noise(means, channel, white, mean_model, nuisance.transfer(means.cycles_per_px))
    scale = row_scale(nuisance.error_scale[channel])
    uneven = np.maximum(means.shading[:, channel] - _EVEN * white, 0.0)
    sparkle = (_SPARKLE * white) ** 2
    ordinary = scale[0] * sparkle + (_EXTRA_TO_SHADING * uneven) ** 2
    lamp = np.maximum(ordinary, (_FIRST_SPARKLE * white) ** 2)
    weights = np.ones(len(values))
    for _ in range(_ITERATIONS):
        model = _Model.of(nuisance, means, rows, lower)
        precision = noise.precision(scale, model.usable) * weights[:, None, None]
        joint, spread = _beside_lamps(precision, model.mirror, lamp)
        solution, normal = system.solve(model.design, model.mirror, values, joint)
        field = system.field(solution)
        missed = values - system.lit(solution, model.design) - model.mirror * field[:, None]
        extra = spread * np.einsum("br,brs,bs->b", model.mirror, precision, missed)
        lamp = (_LAMP_FREEDOM * ordinary + extra**2 + spread) / (_LAMP_FREEDOM + 1.0)
        residual = missed - model.mirror * extra[:, None]
        squared = residual**2 / noise.residual_variance(scale)
        # a stray mean is a lamp's, which has an unknown of its own; weights judge the harmonics
        weights = _block_weights(squared, model.usable)
        # only what stands out of the noise can tell how the lower face mirrors it
        mirrored = field + extra**3 / np.maximum(extra**2 + spread, 1e-30)
        slopes = nuisance.slopes(values - residual, model.face * mirrored[:, None], means.cycles_per_px)
        step = system.beside(normal, model.design, model.mirror, joint, slopes, missed)
        nuisance, doubt = nuisance.stepped(step.information, step.right)
    inverse = np.asarray(np.linalg.inv(normal), float)
    left = joint - system.explained(inverse, model.design, model.mirror, joint)
    pull = np.einsum("brs,bs->br", joint, missed)
    scales = next_scales(nuisance.error_scale[channel], noise, sparkle, ordinary, model.usable, pull, left)
    packed = solution[: len(solution) - system.field_size]
    return ChannelFit(
        packed=packed,
        covariance=_covariance(packed, inverse + step.carried @ doubt @ step.carried.T),
        field=field,
        reflection=field + extra,
        predicted=values - residual,
        chi2=float(np.mean((weights[:, None] * squared)[model.usable])) if np.any(model.usable) else float("nan"),
        unexplained=unexplained_share(means, channel, white, values - residual, model.transfer),
        nuisance=nuisance.rescaled(channel, scales if noise.whole else (max(scales[0], 1.0), max(scales[1], 1.0))),
    )


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
        return cls(transfer, design, face, mirror, _usable(means, transfer))


def _covariance(packed: Array, of_all: Array) -> Array:
    """Covariance of the coefficients, out of that of all unknowns: what scales the whole measurement is added."""
    size = len(packed)
    return np.asarray(of_all[:size, :size] + _GAIN_DOUBT**2 * np.outer(packed, packed), float)


def _beside_lamps(precision: Array, mirror: Array, lamp: Array) -> tuple[Array, Array]:
    """Precision matrices (blocks, 7, 7) when each block mirrors an unknown extra of variance `lamp` (blocks,).

    Sherman-Morrison: a block that mirrors a lamp keeps only what the lamp cannot imitate. Also the variance (blocks,)
    with which the extra is known.
    """
    seen = np.einsum("brs,bs->br", precision, mirror)
    spread = lamp / (1.0 + lamp * np.sum(seen * mirror, axis=1))
    return precision - spread[:, None, None] * seen[:, :, None] * seen[:, None, :], spread


def _without_lamps(precision: Array, mirror: Array, lamp: Array) -> Array:
    """`_beside_lamps` for rows (blocks, 7) whose errors are independent."""
    matrices = np.zeros((*precision.shape, precision.shape[1]))
    row = np.arange(precision.shape[1])
    matrices[:, row, row] = precision
    return _beside_lamps(matrices, mirror, lamp)[0]


def _next_lamps(residual: Array, precision: Array, mirror: Array, lamp: Array, ordinary: Array) -> tuple[Array, Array]:
    """What each block mirrors beside the smooth field, and the variance to grant it (a Student-t, block by block)."""
    seen = np.sum(precision * mirror**2, axis=1)
    spread = lamp / (1.0 + lamp * seen)
    extra = spread * np.sum(precision * mirror * residual, axis=1)
    return extra, (_LAMP_FREEDOM * ordinary + extra**2 + spread) / (_LAMP_FREEDOM + 1.0)


def _block_weights(squared: Array, usable: NDArray[np.bool_]) -> Array:
    """Student-t weight (blocks,) by all harmonics of a block together: what hides a block spoils all its rows."""
    count = np.sum(usable[:, 1:], axis=1)
    total = np.sum(np.where(usable[:, 1:], squared[:, 1:], 0.0), axis=1)
    return (_FREEDOM + count) / (_FREEDOM + total)


def _usable(means: BlockMeans, transfer: Array) -> NDArray[np.bool_]:
    """(blocks, 7) rows that were measured and that blur has left."""
    order = np.repeat(np.arange(1, transfer.shape[1] // 2 + 1), 2)
    usable = np.ones(transfer.shape, bool)
    usable[:, 1:] = (order <= means.harmonics[:, None]) & (transfer[:, 1:] > _WEAKEST_TRANSFER)
    return usable & means.valid[:, None]
