"""Red and blue where the video stores chroma at half resolution.

Luma shows the stripes, subsampled and coarsely quantised chroma does not. So a pixel's chroma is predicted, from the
stripes that the last estimate gives its block, or at first from a line in linear RGB between the colours of the black
and the white regions, along which luma says how far. The measured chroma corrects the prediction: its mean over the
block always, its swing at the stripes' phase as far as the stream has kept it. How far that is, and by how much chroma
is displaced, is read off the frame itself. What a correction leaves, the next frame's prediction no longer contains.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.tracking.decoding import Decoding

Array = NDArray[np.float64]

_LINE_NODES = 24
_SWING_NOISE = 0.35 / 224.0
"""Error of a chroma swing: codecs quantise it coarsely, and drop the smallest."""
_WEAKEST_SWING = 0.7 / 224.0
"""Expected swings below this say nothing about what the stream does to chroma."""
_PRIOR_VARIANCE_PX2 = 1.0
_PRIOR_SHIFT_PX = 0.3
"""How far encoders' chroma is from where their tags put it."""


@dataclass(frozen=True, slots=True)
class ChromaCorrection:
    """What to add to the chroma expected from luma."""

    shift: Array
    """(blocks, 2) mean of Cb and Cr."""
    swing: Array
    """(blocks, 2, 2) cosine and sine part of Cb and Cr at the stripes' phase."""
    trust: Array
    """(blocks,) share of a colour swing that was seen, 0 to 1."""


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


def chroma_correction(
    measured: Array, expected: Array, mean_difference: Array, cycles_per_px: Array, displacement_px: Array
) -> ChromaCorrection:
    """Compare measured with expected chroma, block by block.

    Args:
        measured, expected: (b, 2) complex swing of Cb and Cr at the stripes' phase (cosine - i sine).
        mean_difference: (b, 2) measured less expected mean.
        cycles_per_px: (b, 2) frequency of the stripes.
        displacement_px: (2,) where, by the stream's tags, the chroma that a pixel shares lies from it on average [px].
    """
    gain, turn = _channel_of_chroma(measured, expected, cycles_per_px, displacement_px)
    # a Wiener filter: undo the attenuation as far as the swing stands out of the codec's noise
    power = np.mean(np.abs(measured) ** 2, axis=1) + gain**2 * np.mean(np.abs(expected) ** 2, axis=1)
    seen = gain / (gain**2 + _SWING_NOISE**2 / np.maximum(power, 1e-12))
    missing = (measured * turn[:, None] - gain[:, None] * expected) * seen[:, None]
    patterned = np.any(cycles_per_px != 0.0, axis=1)
    missing = np.where(patterned[:, None], missing, 0.0)
    return ChromaCorrection(mean_difference, np.stack([missing.real, -missing.imag], axis=-1), gain * seen)


def _channel_of_chroma(
    measured: Array, expected: Array, cycles_per_px: Array, displacement_px: Array
) -> tuple[Array, NDArray[np.complex128]]:
    """Attenuation (b,) of chroma swings, and the unit factor (b,) that undoes chroma's displacement."""
    power = np.sum(np.abs(expected) ** 2, axis=1)
    cross = np.sum(measured * expected.conj(), axis=1)
    frequency = np.sum(cycles_per_px**2, axis=1)
    strong = (power > _WEAKEST_SWING**2) & (frequency > 0.0) & (frequency < 0.2**2)
    ratio = np.where(strong, cross / np.maximum(power, 1e-12), 1.0)
    weight = np.where(strong, power / _SWING_NOISE**2, 0.0)
    exponent = 2.0 * np.pi**2 * frequency
    fall = np.clip(-np.log(np.maximum(np.abs(ratio), 0.05)), 0.0, 3.0)
    variance = (_PRIOR_VARIANCE_PX2 + np.sum(weight * exponent * fall)) / (1.0 + np.sum(weight * exponent**2))
    wave = 2.0 * np.pi * cycles_per_px
    turned = wave @ displacement_px
    reliable = strong & (np.abs(ratio) > 0.25)
    angle = np.where(reliable, np.angle(ratio * np.exp(-1j * turned)), 0.0)
    normal = (wave * weight[:, None]).T @ wave + np.eye(2) / _PRIOR_SHIFT_PX**2
    shift = displacement_px + np.linalg.solve(normal, (wave * weight[:, None]).T @ angle)
    return np.exp(-exponent * variance), np.exp(-1j * wave @ shift)
