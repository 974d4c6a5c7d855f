"""Robust weighted least squares of one colour channel: weights, blur and solution are refined together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.normal_equations import BlockSystem
from arlight.estimation.response import optical_transfer
from arlight.estimation.row_noise import row_variance
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

_ITERATIONS = 6
_FREEDOM = 4.0
"""Degrees of freedom of the Student-t distribution of the rows' errors."""
_BLUR_RANGE_PX2 = (0.0, 6.0)
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
    """(blocks,) reflection that each block's own mean shows; the field's where it shows none."""
    lit: Array
    """(blocks, 7) rows that the lighting predicts, blur included."""
    chi2: float
    """Robust chi-square per row; nan when no row was usable."""
    blur_variance_px2: float
    """Blur at which the stripes fit best [px^2]."""


def fit_channel(
    means: BlockMeans, channel: int, white: float, rows: Array, mirror: Array, system: BlockSystem, blur: float
) -> ChannelFit:
    """Fit one channel.

    Args:
        means: the frame's measurements.
        channel: 0, 1, 2 for red, green, blue.
        white: radiance of clear film on white paper.
        rows: (blocks, 7, 3) response before blur; mirror: (blocks, 7) response to the reflection field.
        system: gathers and solves the normal equations.
        blur: first guess of the blur's variance [px^2].
    """
    values = means.values[:, :, channel]
    weights = np.ones_like(values)
    for _ in range(_ITERATIONS):
        transfer = optical_transfer(means.cycles_per_px, blur)
        design, reflecting = rows * transfer[..., None], mirror * transfer
        usable = _usable(means, transfer)
        variance = row_variance(means, channel, white, transfer)
        precision = np.where(usable, weights / variance, 0.0)
        solution, normal = system.solve(design, reflecting, values, precision)
        lit, field = system.lit(solution, design), system.field(solution)
        residual = values - lit - reflecting * field[:, None]
        squared = residual**2 / variance
        weights = (_FREEDOM + 1.0) / (_FREEDOM + squared)
        blur = _next_blur(blur, lit, residual, precision, means.cycles_per_px)
    size = len(solution) - system.field_size
    own = (values[:, 0] - lit[:, 0]) / mirror[:, 0]
    return ChannelFit(
        packed=solution[:size],
        covariance=np.linalg.inv(normal)[:size, :size],
        field=field,
        reflection=np.where(usable[:, 0], own, field),
        lit=lit,
        chi2=float(np.mean((weights * squared)[usable])) if np.any(usable) else float("nan"),
        blur_variance_px2=blur,
    )


def _usable(means: BlockMeans, transfer: Array) -> NDArray[np.bool_]:
    """(blocks, 7) rows that were measured and that blur has left."""
    order = np.repeat(np.arange(1, transfer.shape[1] // 2 + 1), 2)
    usable = np.ones(transfer.shape, bool)
    usable[:, 1:] = (order <= means.harmonics[:, None]) & (transfer[:, 1:] > _WEAKEST_TRANSFER)
    return usable & means.valid[:, None]


def _next_blur(blur: float, lit: Array, residual: Array, precision: Array, cycles_per_px: Array) -> float:
    """One Gauss-Newton step on the blur's variance: d row / d blur = -2 pi^2 |m nu|^2 row."""
    order = np.concatenate([[0.0], np.repeat(np.arange(1.0, lit.shape[1] // 2 + 1), 2)])
    slope = -2.0 * np.pi**2 * np.sum(cycles_per_px**2, axis=1)[:, None] * order**2 * lit
    power = np.sum(precision * slope**2)
    step = np.sum(precision * slope * residual) / power if power > 0.0 else 0.0
    return float(np.clip(blur + step, *_BLUR_RANGE_PX2))
