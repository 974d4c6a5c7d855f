"""From block measurements to lighting: robust weighted least squares with the mirror reflection as a nuisance.

Unknown for each channel are the coefficients and the reflection field. Green is solved first: it is nearly luma, the
sharpest of the three, and the reflection in red and blue follows its pattern, for it is the same mirrored scene.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.channel_fit import ChannelFit, fit_channel
from arlight.estimation.lighting import Lighting
from arlight.estimation.normal_equations import BlockSystem
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.prior import color_spread, color_stddev, prior_stddev
from arlight.estimation.reflection import field_amplitude, reflection_basis
from arlight.estimation.resampling import resampling
from arlight.estimation.response import BlockResponse
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL
from arlight.fourier import unpack_real
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

_GREEN = 1
_FIELD_FLOOR = 1e-3
"""Least standard deviation of the reflection field, relative to white."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Lighting of one frame, and what came with it."""

    lighting: Lighting
    """Coefficients with covariance."""
    stripes: Array
    """(blocks, 7, 3) rows that the estimate predicts, for measuring the next frame [full scale]."""
    reflection: Array
    """(blocks, 3) mirror reflection in the film's upper face [full scale]."""
    nuisance: Nuisance
    """Blur and lower face as the stripes show them."""
    unexplained: float
    """Share of the stripes that no light explains on this sheet, as green shows it; nan where they are not resolved."""


class LightingEstimator:
    """Estimates lighting from a sheet's block measurements; what the view does not change is prepared once."""

    def __init__(self, probe: Probe, assembly: Assembly | None = None, *, bounces: bool = True) -> None:
        """Prepare for a sheet; `assembly` and `bounces` as in `BlockResponse`."""
        assembly = assembly or Assembly()
        blocks = field_blocks(probe)
        kinds = np.array([block.kind for block in blocks])
        self._frequencies = probe.frequencies
        self._slab = assembly.slab(probe)
        self._response = BlockResponse(probe, assembly, bounces=bounces)
        self._resampling = resampling(probe, assembly)
        self._patterned = kinds == "pattern"
        self._white = kinds == "clear_white"
        self._black_film = np.isin(kinds, ["black_white", "black_black"])
        self._clear_black = kinds == "clear_black"
        self._mean_model = np.where(self._white, WHITE_MODEL, MEAN_MODEL)
        self._basis = reflection_basis(np.array([block.center_mm for block in blocks], float).reshape(-1, 2))
        self._white_per_irradiance = probe.paper_reflectance * probe.film_transmittance**2 / np.pi

    def estimate(self, means: BlockMeans, time_s: float, nuisance: Nuisance | None = None) -> Estimate:
        """Lighting of one frame.

        Args:
            means: the frame's measurements.
            time_s: the frame's time [s].
            nuisance: where to start, such as the last frame's.

        Returns:
            The estimate. Blocks that were not seen add nothing; with none at all the covariance is the prior's.
        """
        start = nuisance or Nuisance()
        white = self._white_level(means)
        lower = self._response.lower_mirror(means)
        shape = start.shape
        if shape is None:
            rows = self._response.light(means)
            shape = _shape(self._fit(means, rows, lower, _GREEN, white, start, None))
        rows = self._response.light(means, shape)
        green = self._fit(means, rows, lower, _GREEN, white, start, None)
        red, blue = (self._fit(means, rows, lower, channel, white, green.nuisance, green) for channel in (0, 2))
        fits = (red, green, blue)
        spreads = (
            self._color_spread(red, green, start.color_spread[0]),
            self._color_spread(blue, green, start.color_spread[1]),
        )
        lighting = self._lighting(fits, time_s)
        reflection = np.stack([fit.reflection for fit in fits], axis=1)
        stripes = _guide(np.stack([fit.predicted for fit in fits], axis=2), white)
        scales = tuple(fit.nuisance.error_scale[channel] for channel, fit in enumerate(fits))
        learnt = replace(green.nuisance, color_spread=spreads, shape=_shape(green), error_scale=scales)
        return Estimate(lighting, stripes, reflection, learnt, green.unexplained)

    def _lighting(self, fits: tuple[ChannelFit, ...], time_s: float) -> Lighting:
        solved = [(fit.packed, fit.covariance) for fit in fits]
        if self._resampling is not None:
            solved = [self._resampling.apply(*channel) for channel in solved]
        return Lighting(
            self._frequencies,
            unpack_real(np.stack([packed for packed, _ in solved], axis=1)),
            np.stack([covariance for _, covariance in solved]),
            time_s,
            float(np.mean([fit.chi2 for fit in fits])),
        )

    def _white_level(self, means: BlockMeans) -> Array:
        """(3,) radiance of clear film on white paper; from the patterned blocks where no white is seen."""
        white = means.values[self._white & means.valid, 0]
        if len(white):
            return np.maximum(np.median(white, axis=0), 1e-3)
        patterned = means.values[self._patterned & means.valid, 0]
        return np.maximum(8.0 * np.median(patterned, axis=0), 1e-3) if len(patterned) else np.full(3, 0.5)

    def _fit(
        self, means: BlockMeans, rows: Array, lower: Array, channel: int, white: Array, nuisance: Nuisance,
        green: ChannelFit | None,
    ) -> ChannelFit:  # fmt: skip
        level = float(white[channel])
        fresnel = self._slab.interface_reflectance(means.view_cosine)
        basis = self._basis * (fresnel / fresnel.mean())[:, None]
        black = (self._black_film | self._clear_black) & means.valid
        amplitude = field_amplitude(means.values[black, 0, channel], _FIELD_FLOOR * level)
        deviation = np.full(basis.shape[1], amplitude)
        deviation[0] = level
        if green is not None:
            shape = green.reflection / max(float(np.std(green.reflection)), 1e-6)
            basis, deviation = np.column_stack([basis, shape]), np.append(deviation, level)
        irradiance = level / self._white_per_irradiance
        spread = prior_stddev(self._frequencies, irradiance)
        expected = np.zeros_like(spread)
        if green is not None:
            share = level / white[_GREEN]
            expected = green.packed * share
            colorful = color_stddev(self._frequencies, irradiance, nuisance.color_spread[channel // 2])
            spread = np.hypot(colorful, share * np.sqrt(np.diagonal(green.covariance)))
        system = BlockSystem(
            self._response.places,
            basis,
            np.concatenate([expected, np.zeros_like(deviation)]),
            np.concatenate([spread, deviation]),
        )
        return fit_channel(means, channel, level, rows, lower, self._mean_model, system, nuisance)

    def _color_spread(self, fit: ChannelFit, green: ChannelFit, last: float) -> float:
        difference = fit.packed - green.packed * (fit.packed[0] / max(green.packed[0], 1e-6))
        return color_spread(self._frequencies, float(fit.packed[0]), difference, np.diagonal(fit.covariance), last)


def _shape(green: ChannelFit) -> Array:
    """Real-packed coefficients relative to L~_0."""
    return green.packed / max(float(green.packed[0]), 1e-6)


def _guide(predicted: Array, white: Array) -> Array:
    """Rows (blocks, 7, 3) to expect in the next frame, with each block's stripes of one colour.

    Red and blue stripes are those of green, scaled: what differs in shape comes from chroma, and expecting it again
    would let its errors feed themselves.
    """
    green = predicted[:, 1:, _GREEN : _GREEN + 1]
    # where a block has next to no stripes they are taken to have the colour of white
    floor = (0.01 * white[_GREEN]) ** 2
    slope = (np.sum(predicted[:, 1:] * green, axis=1) + floor * white / white[_GREEN]) / (
        np.sum(green**2, axis=1) + floor
    )
    guide = predicted.copy()
    guide[:, 1:] = green * slope[:, None]
    return guide
