"""The luma plane as trackers want it: codes as they stand in the stream, and what light each code means."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from arlight.radiometry import Radiometry
from arlight.tracking.decoding import decoding
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat


def luma_codes(frame: Frame, radiometry: Radiometry | None = None) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Luma codes (h, w), uint8, and the linear light (256,) of each code.

    An 8-bit luma plane is handed on as it is; other formats are brought to full-range 8 bits first.

    Args:
        frame: the picture.
        radiometry: the camera's own curve; None to believe the footage's.
    """
    format_ = frame.format
    if format_.matrix != "rgb" and format_.bit_depth == 8:
        return np.asarray(frame.planes[0], np.uint8), _table(format_, radiometry)
    return frame.luma(), _table(PixelFormat("gray", True, 8, transfer=format_.transfer), radiometry)


def luma_plane(
    frame: Frame, radiometry: Radiometry | None = None
) -> tuple[NDArray[np.uint8] | NDArray[np.uint16], NDArray[np.float32]]:
    """Luma codes (h, w) as deep as the stream has them, uint8 or uint16, and the linear light (2^bits,) of each code.

    The plane is handed on as it is; only R'G'B' is brought to full-range luma of 8 bits first. Arguments as in
    `luma_codes`.
    """
    if frame.format.matrix == "rgb":
        return luma_codes(frame, radiometry)
    return frame.planes[0], _table(frame.format, radiometry)


@lru_cache(maxsize=16)
def _table(format_: PixelFormat, radiometry: Radiometry | None) -> NDArray[np.float32]:
    black, white = format_.luma_code_range
    codes = np.arange(2**format_.bit_depth)
    return decoding(format_.transfer, radiometry).linear((codes - black) / white).astype(np.float32)
