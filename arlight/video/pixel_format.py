"""How a frame's planes stand for colour: matrix, range, depth, chroma grid, transfer."""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from arlight.color import Transfer

Matrix = Literal["rgb", "gray", "bt601", "bt709", "bt2020", "fcc", "smpte240m"]

LUMA_WEIGHTS: dict[str, tuple[float, float]] = {
    "bt601": (0.299, 0.114),
    "bt709": (0.2126, 0.0722),
    "bt2020": (0.2627, 0.0593),
    "fcc": (0.30, 0.11),
    "smpte240m": (0.212, 0.087),
}
"""Weights of red and blue in Y' (ITU-T H.273, table 4); green has the rest."""

CHROMA_LOCATIONS: dict[str, tuple[float, float]] = {
    "left": (0.0, 0.5),
    "center": (0.5, 0.5),
    "topleft": (0.0, 0.0),
    "top": (0.5, 0.0),
    "bottomleft": (0.0, 1.0),
    "bottom": (0.5, 1.0),
}
"""Where chroma lies between the first (0) and last (1) luma column and row that share it (ITU-T H.273, figure 6)."""

HD_LINES = 720
"""Untagged pictures with this many lines are BT.709, smaller ones BT.601."""


def chroma_offset_px(location: str, shift: tuple[int, int]) -> tuple[float, float]:
    """Position (x, y) of the first chroma sample on the luma grid [px].

    Args:
        location: a key of `CHROMA_LOCATIONS`.
        shift: log2 of the luma columns and rows that share a chroma sample.
    """
    (fx, fy), (sx, sy) = CHROMA_LOCATIONS[location], shift
    return fx * ((1 << sx) - 1), fy * ((1 << sy) - 1)


@dataclass(frozen=True, slots=True)
class PixelFormat:
    """What the numbers in a frame's planes mean."""

    matrix: Matrix
    """`rgb` (three planes R, G, B), `gray` (one plane), or the Y'CbCr matrix of three planes."""
    full_range: bool
    """Codes run from 0 to 2^depth - 1; otherwise black is 16 and white 235 (at 8 bits)."""
    bit_depth: int
    """Bits of a code; 8 in uint8 planes, 9 to 16 in uint16 planes."""
    chroma_shift: tuple[int, int] = (0, 0)
    """log2 of how many luma columns and rows share a chroma sample: (1, 1) is 4:2:0, (1, 0) is 4:2:2."""
    chroma_offset_px: tuple[float, float] = (0.0, 0.0)
    """Position (x, y) of the first chroma sample on the luma grid [px]; 0 where chroma is not subsampled."""
    transfer: Transfer = "srgb"
    """Curve between encoded values and linear light."""

    def __post_init__(self) -> None:
        if self.matrix not in get_args(Matrix):
            raise ValueError(f"matrix must be one of {', '.join(get_args(Matrix))}, found {self.matrix!r}")
        if not 8 <= self.bit_depth <= 16:
            raise ValueError(f"bit_depth must lie in 8..16, found {self.bit_depth}")
        if self.transfer not in get_args(Transfer):
            raise ValueError(f"transfer must be one of {', '.join(get_args(Transfer))}, found {self.transfer!r}")

    @property
    def plane_count(self) -> int:
        """One plane for grey, three otherwise."""
        return 1 if self.matrix == "gray" else 3

    @property
    def dtype(self) -> type[np.uint8] | type[np.uint16]:
        """Type of the codes."""
        return np.uint8 if self.bit_depth == 8 else np.uint16

    @property
    def luma_code_range(self) -> tuple[float, float]:
        """Code of black, and codes from black to white, of Y', grey or R'G'B'."""
        step = 1 << (self.bit_depth - 8)
        return (0.0, float(2**self.bit_depth - 1)) if self.full_range else (16.0 * step, 219.0 * step)

    @property
    def chroma_code_range(self) -> tuple[float, float]:
        """Code of neutral chroma, and codes per unit of Cb and Cr (which span [-1/2, 1/2])."""
        step = 1 << (self.bit_depth - 8)
        return 128.0 * step, float(2**self.bit_depth - 1) if self.full_range else 224.0 * step

    def chroma_size(self, size: tuple[int, int]) -> tuple[int, int]:
        """Width and height of the chroma planes of a picture of `size` (w, h) [px]."""
        (w, h), (sx, sy) = size, self.chroma_shift
        return -(-w >> sx), -(-h >> sy)

    def rgb_from_ycc(self) -> NDArray[np.float32]:
        """Matrix (3, 3) from (Y', Cb, Cr), Y' in [0, 1] and chroma in [-1/2, 1/2], to R'G'B' in [0, 1]."""
        if self.matrix not in LUMA_WEIGHTS:
            return np.eye(3, dtype=np.float32)
        kr, kb = LUMA_WEIGHTS[self.matrix]
        kg = 1.0 - kr - kb
        red, blue = 2.0 * (1.0 - kr), 2.0 * (1.0 - kb)
        return np.array([[1, 0, red], [1, -blue * kb / kg, -red * kr / kg], [1, blue, 0]], np.float32)

    def ycc_from_rgb(self) -> NDArray[np.float32]:
        """Inverse of `rgb_from_ycc`."""
        return np.linalg.inv(self.rgb_from_ycc().astype(np.float64)).astype(np.float32)


def colour_format(format_: PixelFormat, size: tuple[int, int]) -> PixelFormat:
    """The Y'CbCr format nearest to a format, for a picture of `size` (w, h) [px].

    Grey keeps its range and gets 4:2:0 chroma, R'G'B' becomes limited-range 4:4:4, Y'CbCr stays as it is.
    """
    matrix: Matrix = "bt709" if min(size) >= HD_LINES else "bt601"
    if format_.matrix == "gray":
        offset = chroma_offset_px("left", (1, 1))
        return replace(format_, matrix=matrix, chroma_shift=(1, 1), chroma_offset_px=offset)
    if format_.matrix == "rgb":
        return replace(format_, matrix=matrix, full_range=False)
    return format_
