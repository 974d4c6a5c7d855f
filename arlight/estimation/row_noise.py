"""How far a block's rows may stray from the model: noise of the pixels, and what the model leaves out.

Noise differs from pixel to pixel and is told by the pixels. What model and codec leave out is alike in neighbouring
pixels, in blocks of one frequency, and in neighbouring frames; how much it is, the rows' residuals tell.
"""

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.stripe_rows import HARMONIC_OF_ROW
from arlight.tracking.block_means import ROWS, BlockMeans

Array = NDArray[np.float64]

_FLOOR = 0.002
"""Least standard deviation of a pixel, relative to white: quantisation to 8 bits."""
_STRAY = 0.015
"""Deviation of pixels from the fitted stripes that codec and noise explain, relative to white; what goes beyond is the
image of a lamp in the film, which moves many pixels together."""
_QUIET, _NOISY = 0.1, 3.0
"""The same in a noisy picture: this quantile of the blocks' pixel variance, times this."""
_LAMP_PIXELS = 60.0
"""How many pixels the image of a lamp moves together."""
MEAN_MODEL = 0.0012
"""Standard deviation of the model's error in a patterned or black block's mean, relative to white."""
WHITE_MODEL = 0.01
"""The same for white blocks, whose bounced light comes in part from darker neighbours."""
_SWING_MODEL = 0.001
"""The same in a harmonic that the pixels resolve well."""
_CODEC = 0.005
"""And in one at half the pixels' frequency, where codecs quantise coarsely; it grows with the frequency's square."""
_TRANSFER = 0.03
"""Error of the logarithm of what blur leaves of a harmonic, relative to that logarithm."""
_COLOR_SPREAD = 0.05
"""How much the stripes' colour differs between blocks: error of a harmonic that was inferred from luma."""
_GENEROUS = np.repeat((1.0, 4.0), (1, ROWS - 1))
"""Scale of the model's errors in mean and harmonics that suits coarse codecs."""
_LEAST_TRUST = 0.02
_FAINTEST = 0.05
_CHROMA_MEAN = 0.001
"""Error of a mean of red or blue that comes from subsampled, coarsely quantised chroma: an eighth of a level."""
_CHROMA_SWING = 0.001
"""The same of a harmonic."""


class UsualErrors(ctypes.Structure):
    """The constants above for the compiled fit, as in row_noise.h."""

    _fields_ = tuple(
        (name, ctypes.c_double)
        for name in (
            "floor", "stray", "quiet", "noisy", "lamp_pixels", "swing_model", "codec", "transfer", "faintest",
            "color_spread", "least_trust", "chroma_mean", "chroma_swing",
        )
    )  # fmt: skip

    @classmethod
    def of_rows(cls) -> "UsualErrors":
        """Filled in."""
        return cls(
            _FLOOR, _STRAY, _QUIET, _NOISY, _LAMP_PIXELS, _SWING_MODEL, _CODEC, _TRANSFER, np.log(_FAINTEST),
            _COLOR_SPREAD, _LEAST_TRUST, _CHROMA_MEAN, _CHROMA_SWING,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class RowNoise:
    """Expected errors of one channel's rows."""

    pixels: Array
    """(blocks, 7, 7) covariance that the pixels' noise gives them [full scale squared]."""
    model: Array
    """(blocks, 7) variance of what model and codec leave out, as it usually is [full scale squared]."""
    inferred: Array
    """(blocks, 7) variance of what was inferred from luma instead of seen [full scale squared]."""
    trust: Array
    """(blocks, 7) share of a row that was seen; the rest repeats the last estimate."""

    def variance(self, scale: Array) -> Array:
        """(blocks, 7) variance of the rows where the model's errors are scaled by (7,)."""
        return (np.diagonal(self.pixels, axis1=1, axis2=2) + scale * self.model + self.inferred) / self.trust**2


def row_noise(means: BlockMeans, channel: int, white: float, mean_model: Array, transfer: Array) -> RowNoise:
    """Errors to expect of each row.

    Args:
        channel: 0, 1, 2 for red, green, blue.
        white: radiance of clear film on white paper in that channel.
        mean_model: (blocks,) standard deviation of the model's error in the mean, relative to white.
        transfer: (blocks, 7) what blur is thought to leave of each row.
    """
    pixel = np.maximum(means.pixel_variance[:, channel], (_FLOOR * white) ** 2)
    quiet = float(np.quantile(pixel[means.valid], _QUIET)) if np.any(means.valid) else 0.0
    lamps = np.maximum(pixel - max((_STRAY * white) ** 2, _NOISY * quiet), 0.0)
    pixel = pixel - lamps + _LAMP_PIXELS * lamps
    pixels = means.covariance * pixel[:, None, None]
    model, inferred = np.zeros((2, len(pixels), ROWS))
    model[:, 0] = (mean_model * white) ** 2
    cycles = np.hypot(*means.cycles_per_px.T)[:, None] * HARMONIC_OF_ROW[1:]
    model[:, 1:] = (white * (_SWING_MODEL + _CODEC * (2.0 * cycles) ** 2)) ** 2
    swing = np.repeat(np.hypot(means.values[:, 1::2, channel], means.values[:, 2::2, channel]), 2, axis=1)
    model[:, 1:] += (_TRANSFER * np.log(np.maximum(transfer[:, 1:], _FAINTEST)) * swing) ** 2
    trust = np.ones_like(model)
    if channel != 1:
        subsampled = np.where(means.color_trust < 1.0, white, 0.0)
        model[:, 0] += (_CHROMA_MEAN * subsampled) ** 2
        model[:, 1:] += (_CHROMA_SWING * subsampled[:, None]) ** 2
        unseen = _COLOR_SPREAD * (1.0 - means.color_trust)
        inferred[:, 1:] = (unseen[:, None] * swing) ** 2
        trust[:, 1:] = np.maximum(means.color_trust, _LEAST_TRUST)[:, None]
    return RowNoise(pixels, model, inferred, trust)


def row_variance(means: BlockMeans, channel: int, white: float, mean_model: Array) -> Array:
    """Variance (blocks, 7) of each row's error where no residuals tell how large the model's errors are.

    Args: as of `row_noise`.
    """
    noise = row_noise(means, channel, white, mean_model, np.ones((len(means.valid), ROWS)))
    return noise.variance(_GENEROUS) + np.diagonal(noise.pixels, axis1=1, axis2=2)
