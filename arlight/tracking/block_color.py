"""Red and blue where the video stores chroma at a lower resolution, as long as no stripes are known.

Luma shows the stripes, subsampled and coarsely quantised chroma does not. Chroma is predicted from the stripes that the
last estimate gives each block (block_hue.h), or at first from a line in linear RGB between the colours of the black and
the white regions, along which luma says how far. The stored chroma corrects the prediction (block_chroma.h).
"""

import numpy as np
from numpy.typing import NDArray

from arlight.tracking.decoding import Decoding

Array = NDArray[np.float64]

_LINE_NODES = 24


def color_line(dark: Array, bright: Array, curve: Decoding, ycc_from_rgb: Array) -> tuple[Array, Array]:
    """Nodes of the line between two colours, and on, in encoded values.

    Args:
        dark, bright: (3,) linear RGB.
        curve: how the picture is encoded.
        ycc_from_rgb: (3, 3) of the picture's format.

    Returns:
        luma (nodes,), increasing, and chroma (nodes, 2).
    """
    t = 1.2 * np.linspace(0.0, 1.0, _LINE_NODES) ** 2
    slope = np.maximum(bright - dark, 1e-4)
    linear = dark + t[:, None] * slope / slope.max()
    ycc = curve.encoded(linear) @ ycc_from_rgb.T
    return np.maximum.accumulate(ycc[:, 0]), np.ascontiguousarray(ycc[:, 1:])
