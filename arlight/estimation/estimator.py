"""From block measurements to lighting: robust weighted least squares with the mirror reflection as a nuisance.

Unknown for each channel are the coefficients and the reflection field. Green is solved first: it is nearly luma, the
sharpest of the three, and the reflection in red and blue follows its pattern, for it is the same mirrored scene.
"""

import ctypes
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.channel_fit import SheetFit
from arlight.estimation.lighting import Lighting
from arlight.estimation.measured_blocks import CHANNELS, MeasuredBlocks
from arlight.estimation.nuisance import NUMBERS, Nuisance
from arlight.estimation.reflection import reflection_basis
from arlight.estimation.resampling import Resampling, resampling
from arlight.estimation.response import BlockResponse
from arlight.estimation.row_noise import MEAN_MODEL, WHITE_MODEL
from arlight.fourier import orders_up_to, unpack_real
from arlight.native import Workspace, address, library
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import ROWS, BlockMeans

Array = NDArray[np.float64]

ITERATIONS = 2
"""How often a frame's weights and solution are refined after the first frame: with less, a lamp that comes into a block
spoils the frame; more changes nothing."""
_native = library(__file__, "sheet_estimate")
_native.estimate_sheet.argtypes = (*((ctypes.c_void_p,) * 4), ctypes.c_int64, *((ctypes.c_void_p,) * 6))


class _SheetEstimate(Workspace):
    """As in sheet_estimate.c."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("measured", "response", "fit")),
        *((name, ctypes.c_int64) for name in ("all", "passes")),
        *((name, ctypes.c_double) for name in ("chi2", "unexplained")),
    )


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
        green next, of fine stripes beside a lamp by more than it was. Half of each step lets overshoots of up to three
        times die away.

        Args:
            measured: (blocks,) which blocks were measured, all by default; the others keep their stripes.
        """
        guide = self.stripes + stripes
        guide *= 0.5
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
        self._frequencies, self._count = probe.frequencies, len(blocks)
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
        parts = (ctypes.addressof(part.native) for part in (self._measured, self._response, self._fit))
        self._shared = _SheetEstimate(*parts, len(blocks), iterations)
        self._at = ctypes.byref(self._shared)
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
        count = len(self._frequencies) if order is None else self._count_up_to(order)
        start, unknown = nuisance or Nuisance.guess(), 2 * count - 1
        known = unknown if start.shape is None else len(start.shape)
        self._response.expect(known)
        kept = self._measured.point(means, self._fit.begin(count))
        coefficients = np.empty((count, CHANNELS), complex)
        stripes, reflection = np.empty((self._count, ROWS, CHANNELS)), np.empty((self._count, CHANNELS))
        told = Nuisance(np.empty(NUMBERS), np.empty(unknown), np.empty((2, len(self._response.cosine))))
        sensible = _native.estimate_sheet(
            self._at, *_places(start), known, *_places(told), address(coefficients, np.complex128),
            address(stripes, np.float64), address(reflection, np.float64),
        )  # fmt: skip
        del kept
        lighting = self._lighting(coefficients, time_s)
        # where the frame made no sense the next one starts anew
        nuisance = told if sensible else Nuisance.guess()
        return Estimate(lighting, stripes, reflection, nuisance, self._shared.unexplained)

    def _count_up_to(self, order: int) -> int:
        """How many frequencies have an order of at most `order`."""
        if order not in self._counts:
            self._counts[order] = int(np.sum(orders_up_to(self._frequencies, order)))
        return self._counts[order]

    def _lighting(self, coefficients: NDArray[np.complex128], time_s: float) -> Lighting:
        count, covariance = len(coefficients), self._fit.covariance
        resampled = self._resampled(count)
        if resampled is not None:
            packed, covariance = resampled.apply(self._fit.packed, covariance)
            coefficients = unpack_real(packed.T)
        return Lighting(self._frequencies[:count], coefficients, covariance, time_s, self._shared.chi2)

    def _resampled(self, count: int) -> Resampling | None:
        """What makes whole frequencies of the first `count` measured ones."""
        if count not in self._resampling:
            self._resampling[count] = resampling(*self._sheet, count)
        return self._resampling[count]


def _places(nuisance: Nuisance) -> tuple[int | None, ...]:
    """Where its numbers, its blocks and its shape lie in memory."""
    arrays = nuisance.numbers, nuisance.blocks, nuisance.shape
    return tuple(None if array is None else address(array, np.float64) for array in arrays)
