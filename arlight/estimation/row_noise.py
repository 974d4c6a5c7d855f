"""How far a block's rows may stray from the model: noise of the pixels, and what the model leaves out."""

import numpy as np
from numpy.typing import NDArray

from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]

_FLOOR = 0.002
"""Least standard deviation of a pixel, relative to white: quantisation to 8 bits."""
_CORRELATION = 2.0
"""Pixels that codecs and demosaicing make alike count once."""
_STRAY = 0.015
"""Deviation of pixels from the fitted stripes that codec and noise explain, relative to white; what goes beyond is the
image of a lamp in the film, which moves many pixels together."""
_LAMP_PIXELS = 60.0
"""How many pixels the image of a lamp moves together."""
MEAN_MODEL = 0.0012
"""Standard deviation of the model's error in a patterned or black block's mean, relative to white."""
WHITE_MODEL = 0.01
"""The same for white blocks, whose bounced light comes in part from darker neighbours."""
_SWING_MODEL = 0.001
"""The same in a harmonic that the pixels resolve well."""
_CODEC = 0.012
"""And in one at half the pixels' frequency, where codecs quantise coarsely; it grows with the frequency's square."""
_COLOR_SPREAD = 0.05
"""How much the stripes' colour differs between blocks: error of a harmonic that was inferred from luma."""
_LEAST_TRUST = 0.02
_CHROMA_MEAN = 0.001
"""Error of a mean of red or blue that comes from subsampled, coarsely quantised chroma: an eighth of a level."""
_CHROMA_SWING = 0.001
"""The same of a harmonic."""


def row_variance(means: BlockMeans, channel: int, white: float, mean_model: Array) -> Array:
    """Variance (blocks, 7) of each row's error.

    Args:
        channel: 0, 1, 2 for red, green, blue.
        white: radiance of clear film on white paper in that channel.
        mean_model: (blocks,) standard deviation of the model's error in the mean, relative to white.
    """
    pixel = np.maximum(means.pixel_variance[:, channel], (_FLOOR * white) ** 2)
    lamps = np.maximum(pixel - (_STRAY * white) ** 2, 0.0)
    pixel = _CORRELATION * (pixel - lamps) + _LAMP_PIXELS * lamps
    variance = np.diagonal(means.covariance, axis1=1, axis2=2) * pixel[:, None]
    variance[:, 0] += (mean_model * white) ** 2
    order = np.repeat(np.arange(1.0, variance.shape[1] // 2 + 1), 2)
    cycles = np.hypot(*means.cycles_per_px.T)[:, None] * order
    variance[:, 1:] += (white * (_SWING_MODEL + _CODEC * (2.0 * cycles) ** 2)) ** 2
    if channel != 1:
        subsampled = np.where(means.color_trust < 1.0, white, 0.0)
        variance[:, 0] += (_CHROMA_MEAN * subsampled) ** 2
        variance[:, 1:] += (_CHROMA_SWING * subsampled[:, None]) ** 2
        inferred = _COLOR_SPREAD * (1.0 - means.color_trust)
        swing = np.hypot(means.values[:, 1::2, channel], means.values[:, 2::2, channel])
        variance[:, 1:] += (inferred[:, None] * np.repeat(swing, 2, axis=1)) ** 2
        # what was inferred repeats the last estimate; only the share that was seen tells something new
        variance[:, 1:] /= np.maximum(means.color_trust, _LEAST_TRUST)[:, None] ** 2
    return variance
