"""The measurements of a frame's blocks as the compiled fit wants them, and what they tell before anything is fitted."""

import ctypes
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.row_noise import UsualErrors
from arlight.native import Workspace, address, library
from arlight.tracking.block_means import HARMONICS, ROWS, BlockMeans

Array = NDArray[np.float64]

CHANNELS = 3
KINDS = {"pattern": 0, "clear_white": 1, "clear_black": 2, "black_white": 3, "black_black": 3}
"""Numbers of the kinds of blocks in the compiled code."""
_MEASURED = (
    "values", "covariance", "pixel_variance", "shading", "harmonics", "valid", "view_phasor", "view_cosine",
    "cycles_per_px", "color_trust",
)  # fmt: skip
_TYPES = {"harmonics": np.int64, "valid": np.bool_, "view_phasor": np.complex128}
_PLANES = {
    "measured": CHANNELS * ROWS, "pixels": ROWS * (ROWS + 1) // 2, "noise": CHANNELS, "uneven": CHANNELS,
    "resolved": 1, "seen": 1, "trust": 1, "cycles": 2, "left": HARMONICS, "left_log": HARMONICS,
    "fineness": HARMONICS, "face": 1, "scratch": 1,
}  # fmt: skip
_native = library(__file__, "sheet_estimate")


class _MeasuredBlocks(Workspace):
    """As in measured_blocks.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("blocks", "stride")),
        *((name, ctypes.c_void_p) for name in (*_MEASURED, "sequence", "kind")),
        ("index", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("measured", "pixels", "noise", "uneven", "resolved", "seen", "trust")),
        *((name, ctypes.c_void_p) for name in ("phasor", "cosine", "cycles", "left", "left_log", "fineness", "face")),
        ("scratch", ctypes.c_void_p),
        *((name, ctypes.c_double * CHANNELS) for name in ("white", "amplitude", "quiet")),
        ("usual", UsualErrors),
        ("whole", ctypes.c_int64),
    )


class MeasuredBlocks:
    """Planes of one frame's measurements, filled anew for each frame."""

    def __init__(
        self, kinds: Sequence[str], sequence: NDArray[np.int64], refractive_index: float, phasor: Array, cosine: Array
    ) -> None:
        """Make room.

        Args:
            kinds: (blocks,) what each block of the sheet is.
            sequence: (blocks,) the order of the planes.
            refractive_index: of the glass.
            phasor: (2, stride); cosine: (stride,) planes of the response, which are filled as well.
        """
        stride = len(cosine)
        kind = np.zeros(stride, np.uint8)
        kind[: len(sequence)] = np.array([KINDS[name] for name in kinds], np.uint8)[sequence]
        self.native = _MeasuredBlocks(stride=stride, index=refractive_index, usual=UsualErrors.of_rows())
        """What the compiled code is given."""
        self.planes = {name: np.zeros((count, stride)) for name, count in _PLANES.items()}
        """(numbers, stride) each, in the order of the sequence."""
        self.native.hold({
            "sequence": np.ascontiguousarray(sequence, np.int64), "kind": kind, "phasor": phasor, "cosine": cosine,
            **self.planes,
        })  # fmt: skip

    def gather(self, means: BlockMeans, count: int) -> None:
        """Fill the planes with the first `count` blocks of the sequence."""
        kept = self.point(means, count)
        _native.gather(ctypes.byref(self.native))
        del kept

    def point(self, means: BlockMeans, count: int) -> list[NDArray[np.generic]]:
        """Tell the compiled code where the first `count` blocks' measurements lie; to be kept until it is done."""
        kept = []
        for name in _MEASURED:
            kind = _TYPES.get(name, np.float64)
            array: NDArray[np.generic] = np.ascontiguousarray(getattr(means, name), kind)
            kept.append(array)
            setattr(self.native, name, address(array, kind))
        self.native.blocks = count
        return kept

    @property
    def white(self) -> tuple[float, ...]:
        """Radiance of clear film on white paper in the frame; from the patterned blocks where no white is seen."""
        return tuple(self.native.white)
