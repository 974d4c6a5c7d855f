"""Robust weighted least squares of a frame's colour channels: weights, blur and solution are refined together.

Unknown for each channel are the coefficients and the reflection field. Green is solved first: it is nearly luma, the
sharpest of the three, and the reflection in red and blue follows its pattern, for it is the same mirrored scene. What
hides a block or shines into it does so in all colours, so red and blue start from green's lamps and weights.
"""

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation import lamps, robust_weights, stripe_rows
from arlight.estimation.measured_blocks import CHANNELS, MeasuredBlocks
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.prior import color_stddev, prior_stddev
from arlight.estimation.response import BlockResponse
from arlight.native import Workspace, address, library
from arlight.tracking.block_means import ROWS

Array = NDArray[np.float64]

GREEN = 1
_COARSE = 2 / 3
"""Share of the reflection's amplitudes, the smoothest, that suffices to tell lamps and stray blocks, and how the
reflection in red and blue strays from green's pattern."""
_LANES = 4
_NUISANCES, _WIDE, _FREQUENCY = 5, 8, 8
_native = library(__file__, "sheet_estimate")
_native.recall.argtypes = (ctypes.c_void_p,) * 3
_native.fit_channel.argtypes = (ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)
_PLANES = ctypes.c_int64.in_dll(_native, "channel_planes").value


class _ChannelFit(Workspace):
    """As in channel_fit.h."""

    _fields_ = (
        ("m", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("channel", "frequencies", "modes", "coarse", "row")),
        *((name, ctypes.c_int64) for name in ("field", "width", "wide")),
        *((name, ctypes.c_void_p) for name in ("first", "spread", "colorful", "mean_model", "basis")),
        *((name, ctypes.c_void_p) for name in ("basis_planes", "rows", "lower")),
        *((name, ctypes.c_double) for name in ("white_per_irradiance", "lamp_freedom", "weight_freedom", "weakest")),
        *((name, ctypes.c_void_p) for name in ("nuisances", "scales", "spreads", "lamps", "weights")),
        *((name, ctypes.c_void_p) for name in ("nuisance", "scale", "lamp", "weight", "packed", "covariance")),
        *((name, ctypes.c_void_p) for name in ("reflection", "predicted", "planes", "shared", "stacked")),
        *((name, ctypes.c_void_p) for name in ("frequency", "least", "expected", "certain", "solution", "carried")),
        *((name, ctypes.c_void_p) for name in ("carried_light", "fields", "certainty", "products", "small")),
        *((name, ctypes.c_double) for name in ("chi2", "unexplained")),
    )


@dataclass(frozen=True, slots=True)
class FitResult:
    """How well one channel was fitted."""

    chi2: float
    """Robust chi-square per row; nan when no row was usable."""
    unexplained: float
    """Share of the stripes that the fit does not explain, 0 to about 1; nan where too few blocks show clear stripes,
    and for red and blue."""


class SheetFit:
    """Fits the channels of one frame after the other; owns the room that the compiled fit works in.

    Planes are in the order of the response's sequence and filled up to whole lanes.
    """

    packed: Array
    """(3, 2k - 1) real-packed coefficients of each channel [radiance * sr]."""
    covariance: Array
    """(3, 2k - 1, 2k - 1) their covariance."""
    nuisances: Array
    """(3, 5) blur [px^2], sharpness [px^4], lower face, shift x and y [px] at which each channel's stripes fit best."""
    scales: Array
    """(3, 2) variance of the model's errors in means and harmonics, relative to the usual."""
    spreads: Array
    """(3,) of red's and blue's (places 0 and 2) coefficients about green's."""
    lamps: Array
    """(3, stride) variance granted to what each block mirrors by itself [full scale squared]."""
    weights: Array
    """(3, stride) weight of each block."""
    reflection: Array
    """(3, stride) field plus what each block mirrors beside it, such as a lamp [full scale]."""
    predicted: Array
    """(3, 7, stride) rows that light and reflection predict, blur included [full scale]."""

    def __init__(
        self,
        blocks: MeasuredBlocks,
        response: BlockResponse,
        frequencies: NDArray[np.int64],
        basis: Array,
        mean_model: Array,
        white_per_irradiance: float,
    ) -> None:
        """Make room.

        Args:
            blocks: the frame's measurements.
            response: of the sheet, filled for the frame's view before a fit.
            frequencies: (k, 2) of the coefficients, (0, 0) first.
            basis: (blocks, s) of the reflection field.
            mean_model: (blocks,) standard deviation of the model's error in the means, relative to white.
            white_per_irradiance: radiance of white for L~_0 = 1.
        """
        stride, modes = len(response.cosine), basis.shape[1]
        field = modes + 1
        self._first = np.searchsorted(response.places[response.sequence, 1], [0, *range(1, 2 * len(frequencies), 2)])
        self._frequencies = frequencies
        self.nuisances, self.scales = np.zeros((CHANNELS, _NUISANCES)), np.ones((CHANNELS, 2))
        self.spreads = np.zeros(CHANNELS)
        self.lamps, self.weights = np.zeros((CHANNELS, stride)), np.ones((CHANNELS, stride))
        self.reflection, self.predicted = np.zeros((CHANNELS, stride)), np.zeros((CHANNELS, ROWS, stride))
        self._blocks, self._response = blocks, response
        self.native = _ChannelFit(
            m=ctypes.addressof(blocks.native),
            modes=field, coarse=2 + int(_COARSE * (modes - 1)), row=_whole(field + 2),
            white_per_irradiance=white_per_irradiance, lamp_freedom=lamps.FREEDOM,
            weight_freedom=robust_weights.FREEDOM, weakest=stripe_rows.WEAKEST_TRANSFER,
        )  # fmt: skip
        self._pointer = ctypes.byref(self.native)
        self._hold(basis, mean_model)
        self._make_room(stride, self.native.row)

    def _hold(self, basis: Array, mean_model: Array) -> None:
        """Give the compiled code what stays and what it fills."""
        stride, sequence, field = len(self._response.cosine), self._response.sequence, self.native.modes
        rows, model = np.zeros((stride, self.native.row)), np.zeros(stride)
        # the second place is for green's pattern
        rows[: len(sequence), 0], rows[: len(sequence), 2:field] = basis[sequence, 0], basis[sequence, 1:]
        model[: len(sequence)] = mean_model[sequence]
        self.native.hold({
            "first": self._first.astype(np.int32), "spread": prior_stddev(self._frequencies, 1.0),
            "colorful": color_stddev(self._frequencies, 1.0, 1.0), "mean_model": model,
            "basis": rows, "basis_planes": np.ascontiguousarray(rows[:, :field].T),
            "rows": self._response.rows, "lower": self._response.mirror,
            "nuisances": self.nuisances, "scales": self.scales, "spreads": self.spreads, "lamps": self.lamps,
            "weights": self.weights, "reflection": self.reflection, "predicted": self.predicted,
        })  # fmt: skip

    def _make_room(self, stride: int, width: int) -> None:
        unknown = 2 * len(self._frequencies) - 1
        wide, most = _whole(unknown), int(np.diff(self._first).max(initial=1))
        shapes = {
            "planes": (_PLANES, stride), "shared": (width, width), "stacked": (stride + 8, width),
            "frequency": (len(self._frequencies) + 1, _FREQUENCY),
            "least": (width,), "expected": (wide,), "certain": (wide,), "solution": (width,), "carried": (width, _WIDE),
            "carried_light": (wide + 1, _WIDE), "fields": (width, stride), "certainty": (width + 8, wide),
            "products": (wide, wide), "small": (most + 8, most + 8),
        }  # fmt: skip
        self.native.hold({name: np.zeros(shape) for name, shape in shapes.items()})

    def begin(self, count: int) -> int:
        """Prepare for a frame with the first `count` frequencies; returns how many blocks they have."""
        unknown = 2 * count - 1
        self.packed, self.covariance = np.empty((CHANNELS, unknown)), np.empty((CHANNELS, unknown, unknown))
        native = self.native
        native.frequencies, native.wide = count - 1, _whole(unknown)
        native.packed, native.covariance = address(self.packed, np.float64), address(self.covariance, np.float64)
        return int(self._first[count])

    def recall(self, nuisance: Nuisance) -> None:
        """Start from what another frame told: from no lamps and weights of green where it told none."""
        blocks = None if nuisance.blocks is None else address(nuisance.blocks, np.float64)
        _native.recall(self._pointer, address(nuisance.numbers, np.float64), blocks)

    def fit(self, channel: int, passes: int = 1, *, settle: bool = False) -> FitResult:
        """Fit one channel; green starts from the lamps, weights and nuisance at hand, red and blue from green's.

        Args:
            channel: 0, 1, 2 for red, green, blue; green comes first.
            passes: how often lamps, weights and solution are refined.
            settle: look for the nuisance in each of them, not just in the last.
        """
        _native.fit_channel(self._pointer, channel, passes, settle)
        return FitResult(self.native.chi2, self.native.unexplained)


def _whole(count: int) -> int:
    """Rounded up to whole lanes."""
    return -(-count // _LANES) * _LANES
