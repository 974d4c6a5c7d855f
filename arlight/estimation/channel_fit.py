"""Robust weighted least squares of one colour channel: weights, blur and solution are refined together."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.normal_equations import BlockSystem
from arlight.estimation.prior import COLOR_SPREAD
from arlight.estimation.response import optical_transfer
from arlight.estimation.row_noise import row_variance
from arlight.estimation.sheet_match import unexplained_share
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

_ITERATIONS = 4
_FREEDOM = 4.0
"""Degrees of freedom of the Student-t distribution of the rows' errors."""
_SPARKLE = 0.0008
"""Usual standard deviation of what a block mirrors beside the smooth field, relative to white."""
_EXTRA_TO_SHADING = 0.5
"""What a block mirrors beside the smooth field, relative to how uneven the block is: a lamp's halo has a slope."""
_EVEN = 0.005
"""Slope that noise and codec give an even block, relative to white."""
_FIRST_SPARKLE = 0.02
"""The same in the first iteration, wide enough that no lamp pulls the solution before it is recognised."""
_BLUR_RANGE_PX2 = (0.0, 6.0)
_LOWER_FACE_SPREAD = 0.5
"""Prior standard deviation of the lower face's reflection about Fresnel's."""
_WEAKEST_TRANSFER = 0.12
"""Harmonics that blur has taken below this share are not used."""


@dataclass(frozen=True, slots=True)
class Nuisance:
    """What a frame reveals beside the lighting; one frame's is the next one's first guess."""

    blur_variance_px2: float = 0.4
    """Variance of the picture's blur [px^2]."""
    lower_face: float = 1.0
    """Mirror reflection in the glass's lower face, relative to Fresnel's; less where paper sticks to the glass."""
    color_spread: tuple[float, float] = (COLOR_SPREAD, COLOR_SPREAD)
    """How far red and blue coefficients stray from green's, relative to L~_0 at order 1."""
    shape: Array | None = None
    """(2k - 1,) green's real-packed coefficients at the measured frequencies, relative to L~_0; None if unknown."""


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
    variance = row_variance(means, channel, white, mean_model)
    weights = np.ones_like(values)
    uneven = np.maximum(means.shading[:, channel] - _EVEN * white, 0.0)
    ordinary = (_SPARKLE * white) ** 2 + (_EXTRA_TO_SHADING * uneven) ** 2
    lamp = np.maximum(ordinary, (_FIRST_SPARKLE * white) ** 2)
    for _ in range(_ITERATIONS):
        transfer = optical_transfer(means.cycles_per_px, nuisance.blur_variance_px2)
        design = rows * transfer[..., None]
        mirror = nuisance.lower_face * lower * transfer
        mirror[:, 0] += 1.0
        usable = _usable(means, transfer)
        precision = np.where(usable, weights / variance, 0.0)
        solution, normal = system.solve(design, mirror, values, _without_lamps(precision, mirror, lamp))
        lit, field = system.lit(solution, design), system.field(solution)
        residual = values - lit - mirror * field[:, None]
        extra, lamp = _next_lamps(residual, precision, mirror, lamp, ordinary)
        residual = residual - mirror * extra[:, None]
        squared = residual**2 / variance
        # a stray mean is a lamp's, which has an unknown of its own; weights judge the harmonics
        weights[:] = _block_weights(squared, usable)[:, None]
        reflection = field + extra
        nuisance = _next_nuisance(nuisance, lit, lower * transfer * reflection[:, None], residual, precision, means)
    size = len(solution) - system.field_size
    return ChannelFit(
        packed=solution[:size],
        covariance=np.asarray(np.linalg.inv(normal)[:size, :size], float),
        field=field,
        reflection=reflection,
        predicted=lit + mirror * reflection[:, None],
        chi2=float(np.mean((weights * squared)[usable])) if np.any(usable) else float("nan"),
        unexplained=unexplained_share(means, channel, white, values - residual, transfer),
        nuisance=nuisance,
    )


def _without_lamps(precision: Array, mirror: Array, lamp: Array) -> Array:
    """Precision matrices (blocks, 7, 7) when each block mirrors an unknown extra of variance `lamp` (blocks,).

    Sherman-Morrison on diag(1/p) + lamp m m': a block that mirrors a lamp keeps only what the lamp cannot imitate.
    """
    seen = precision * mirror
    shrink = lamp / (1.0 + lamp * np.sum(seen * mirror, axis=1))
    matrices = -shrink[:, None, None] * seen[:, :, None] * seen[:, None, :]
    diagonal = np.arange(precision.shape[1])
    matrices[:, diagonal, diagonal] += precision
    return matrices


def _next_lamps(residual: Array, precision: Array, mirror: Array, lamp: Array, ordinary: Array) -> tuple[Array, Array]:
    """What each block mirrors beside the smooth field, and the variance to grant it (a Student-t, block by block)."""
    seen = np.sum(precision * mirror**2, axis=1)
    spread = lamp / (1.0 + lamp * seen)
    extra = spread * np.sum(precision * mirror * residual, axis=1)
    return extra, (_FREEDOM * ordinary + extra**2 + spread) / (_FREEDOM + 1.0)


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


def _next_nuisance(
    last: Nuisance, lit: Array, lower: Array, residual: Array, precision: Array, means: BlockMeans
) -> Nuisance:
    """One Gauss-Newton step on each; d row / d blur = -2 pi^2 |m nu|^2 row, and the lower face enters linearly."""
    order = np.concatenate([[0.0], np.repeat(np.arange(1.0, lit.shape[1] // 2 + 1), 2)])
    slope = -2.0 * np.pi**2 * np.sum(means.cycles_per_px**2, axis=1)[:, None] * order**2 * lit
    power = np.sum(precision * slope**2)
    blur = last.blur_variance_px2 + (np.sum(precision * slope * residual) / power if power > 0.0 else 0.0)
    pull = (1.0 - last.lower_face) / _LOWER_FACE_SPREAD**2
    face = last.lower_face + (np.sum(precision * lower * residual) + pull) / (
        np.sum(precision * lower**2) + 1.0 / _LOWER_FACE_SPREAD**2
    )
    return replace(
        last,
        blur_variance_px2=float(np.clip(blur, *_BLUR_RANGE_PX2)),
        lower_face=float(np.clip(face, 0.0, 1.5)),
    )
