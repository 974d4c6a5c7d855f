"""From block measurements to lighting: robust weighted least squares with the mirror reflection as a nuisance.

Unknown for each channel are the coefficients and the reflection field. Green is solved first: it is nearly luma, the
sharpest of the three, and the reflection in red and blue follows its pattern, for it is the same mirrored scene.
"""

import ctypes
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.channel_fit import GREEN, FitResult, SheetFit
from arlight.estimation.lighting import Lighting
from arlight.estimation.measured_blocks import CHANNELS, MeasuredBlocks
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.reflection import reflection_basis
from arlight.estimation.resampling import Resampling, resampling
from arlight.estimation.response import BlockResponse
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL
from arlight.fourier import orders_up_to, unpack_real
from arlight.native import address, library
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import ROWS, BlockMeans

Array = NDArray[np.float64]

ITERATIONS = 2
"""How often a frame's weights and solution are refined after the first frame: with less, a lamp that comes into a block
spoils the frame; more changes nothing."""
_FIRST_ITERATIONS = 4
_HALFWAY = 0.5
"""Of the last stripes and the new ones, what guides the next frame; overshoots of up to three times die away."""
_native = library(__file__, "guide", keeps_lock=True)
_native.guide.argtypes = (ctypes.c_void_p,) * 5


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

    def guiding_on(self, measured: NDArray[np.bool_] | None, stripes: Array) -> "Estimate":
        """The same, with stripes that go on from those (blocks, 7, 3) of the last estimate.

        Stripes guide how the next frame's chroma is read, and may be overshot there: what is too red is found too
        green next, of fine stripes beside a lamp by more than it was. Half of each step lets that die away.

        Args:
            measured: (blocks,) which blocks were measured, all by default; the others keep their stripes.
        """
        guide = stripes + _HALFWAY * (self.stripes - stripes)
        if measured is not None:
            guide = np.where(measured[:, None, None], guide, stripes)
        return replace(self, stripes=guide)


class LightingEstimator:
    """Estimates lighting from a sheet's block measurements; what the view does not change is prepared once."""

    def __init__(
        self,
        probe: Probe,
        assembly: Assembly | None = None,
        *,
        bounces: bool = True,
        iterations: int = ITERATIONS,
    ) -> None:
        """Prepare for a sheet.

        Args:
            probe, assembly, bounces: as in `BlockResponse`.
            iterations: how often weights and solution are refined in a frame, 1 or more; the first frame settles by
                itself.
        """
        assembly = assembly or Assembly()
        blocks = field_blocks(probe)
        kinds = [block.kind for block in blocks]
        self._frequencies, self._iterations, self._count = probe.frequencies, iterations, len(blocks)
        self._response = BlockResponse(probe, assembly, bounces=bounces)
        self._measured = MeasuredBlocks(
            kinds,
            self._response.sequence,
            assembly.slab(probe).refractive_index,
            self._response.phasor,
            self._response.cosine,
        )
        self._fit = SheetFit(
            self._measured,
            self._response,
            probe.frequencies,
            reflection_basis(np.array([block.center_mm for block in blocks], float).reshape(-1, 2)),
            np.where(np.array(kinds) == "clear_white", WHITE_MODEL, MEAN_MODEL),
            probe.paper_reflectance * probe.film_transmittance**2 / np.pi,
        )
        self._counts: dict[int, int] = {}
        self._resampling = {len(probe.frequencies): resampling(probe, assembly)}
        self._sheet = probe, assembly

    def estimate(
        self, means: BlockMeans, time_s: float, nuisance: Nuisance | None = None, order: int | None = None
    ) -> Estimate:
        """Lighting of one frame.

        Args:
            means: the frame's measurements.
            time_s: the frame's time [s].
            nuisance: where to start, such as the last frame's.
            order: highest order that is estimated, the sheet's by default; blocks of higher orders need not have been
                measured.

        Returns:
            The estimate. Blocks that were not seen add nothing; with none at all the covariance is the prior's.

        Raises:
            ProbeError: the sheet does not measure the order.
        """
        start, fit = nuisance or Nuisance(), self._fit
        count = len(self._frequencies) if order is None else self._count_up_to(order)
        blocks = fit.begin(count, start)
        self._measured.gather(means, blocks)
        green = self._fit_green(start, blocks)
        chi2 = (fit.fit(0).chi2 + green.chi2 + fit.fit(2).chi2) / CHANNELS
        stripes, reflection = self._guide()
        return Estimate(self._lighting(count, time_s, chi2), stripes, reflection, self._learnt(), green.unexplained)

    def _count_up_to(self, order: int) -> int:
        """How many frequencies have an order of at most `order`."""
        if order not in self._counts:
            self._counts[order] = int(np.sum(orders_up_to(self._frequencies, order)))
        return self._counts[order]

    def _fit_green(self, start: Nuisance, blocks: int) -> FitResult:
        """Fit green from where the last frame left off; a first frame settles, the light's shape among the rest."""
        fit = self._fit
        if start.blocks is None:
            fit.forget()
        else:
            np.multiply(start.blocks[0], self._measured.white[GREEN] ** 2, out=fit.lamps[GREEN])
            fit.weights[GREEN] = start.blocks[1]
        self._response.fill(blocks, start.shape)
        if start.shape is not None:
            return fit.fit(GREEN, self._iterations)
        fit.fit(GREEN, _FIRST_ITERATIONS, settle=True)
        self._response.fill(blocks, _shape(fit.packed[GREEN]))
        return fit.fit(GREEN, _FIRST_ITERATIONS, settle=True)

    def _guide(self) -> tuple[Array, Array]:
        """Stripes (blocks, 7, 3) to expect next, and reflection (blocks, 3); 0 in blocks that were not estimated."""
        stripes, reflection = np.zeros((self._count, ROWS, CHANNELS)), np.zeros((self._count, CHANNELS))
        _native.guide(
            ctypes.addressof(self._measured.native),
            self._fit.native.predicted,
            self._fit.native.reflection,
            address(stripes, np.float64),
            address(reflection, np.float64),
        )
        return stripes, reflection

    def _learnt(self) -> Nuisance:
        """Where the next frame starts: anew where this one made no sense."""
        fit = self._fit
        if not np.isfinite(fit.packed).all():
            return Nuisance()
        blocks = np.empty((2, len(fit.lamps[GREEN])))
        np.multiply(fit.lamps[GREEN], 1.0 / self._measured.white[GREEN] ** 2, out=blocks[0])
        blocks[1] = fit.weights[GREEN]
        return Nuisance.of(
            fit.nuisances[GREEN],
            color_spread=(fit.spreads.item(0), fit.spreads.item(2)),
            error_scale=tuple(map(tuple, fit.scales.tolist())),
            shape=_shape(fit.packed[GREEN]),
            blocks=blocks,
        )

    def _lighting(self, count: int, time_s: float, chi2: float) -> Lighting:
        packed, covariance = self._fit.packed, self._fit.covariance
        resampled = self._resampled(count)
        if resampled is not None:
            packed, covariance = resampled.apply(packed, covariance)
        return Lighting(self._frequencies[:count], unpack_real(packed.T), covariance, time_s, chi2)

    def _resampled(self, count: int) -> Resampling | None:
        """What makes whole frequencies of the first `count` measured ones."""
        if count not in self._resampling:
            self._resampling[count] = resampling(*self._sheet, count)
        return self._resampling[count]


def _shape(green: Array) -> Array:
    """Real-packed coefficients relative to L~_0; light is not negative, so none can be larger."""
    shape = green * (1.0 / max(float(green[0]), 1e-6))
    np.minimum(shape, 1.0, out=shape)
    return np.maximum(shape, -1.0, out=shape)
