"""What is measured on the blocks of one frame: arrays, with nothing left of pixels or codecs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HARMONICS = 3
"""Highest harmonic of the film's pattern that is separated inside a block."""
ROWS = 2 * HARMONICS + 1
"""Measurements a block and channel: mean, then cosine and sine of each harmonic."""


@dataclass(frozen=True, slots=True)
class BlockMeans:
    """Every block's mean radiance and stripe harmonics in one frame, with what is known about their errors."""

    values: NDArray[np.float64]
    """(blocks, 7, 3): mean, cos 1, sin 1, cos 2, ... of linear radiance in the film's phase, RGB [full scale]."""
    covariance: NDArray[np.float64]
    """(blocks, 7, 7): covariance of the values for pixels of unit variance."""
    pixel_variance: NDArray[np.float64]
    """(blocks, 3): variance of one pixel about the fitted stripes [full scale squared]."""
    shading: NDArray[np.float64]
    """(blocks, 3): how uneven a block is beside its stripes, from its middle to its border [full scale]."""
    harmonics: NDArray[np.int64]
    """(blocks,) how many harmonics were separated, 0 to 3; the values beyond are 0 and mean nothing."""
    samples: NDArray[np.int64]
    """(blocks,) pixels that were used."""
    valid: NDArray[np.bool_]
    """(blocks,) enough unclipped pixels were seen."""
    view_phasor: NDArray[np.complex128]
    """(blocks,) mean of exp(-i 2 pi n.Delta(v)) over the pixels' directions toward the viewer."""
    view_cosine: NDArray[np.float64]
    """(blocks,) mean cosine of the angle between viewer and normal."""
    cycles_per_px: NDArray[np.float64]
    """(blocks, 2) frequency of the stripes in the image [1/px]."""
    color_trust: NDArray[np.float64]
    """(blocks,) how far the harmonics of red and blue were seen rather than inferred from luma, 0 to 1."""
