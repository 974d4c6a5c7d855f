"""Red and blue where the video stores chroma at half resolution.

Luma shows the stripes, subsampled and coarsely quantised chroma does not. A block's pixels lie close to a line in
linear RGB, from the mirror reflection (dark) along the colour of its stripes: the line turns each pixel's luma into
an expected chroma. The measured chroma corrects it: its mean over the block always, its swing at the stripes' phase
as far as the stream has kept it. How far that is, and by how much chroma is displaced, is read off the frame itself.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.color import Transfer, encoded_from_linear
from arlight.tracking.block_means import BlockColors

Array = NDArray[np.float64]

_LINE_NODES = 24
_SWING_NOISE = 0.5 / 224.0
"""Error of a chroma swing: codecs quantise it coarsely, and drop the smallest."""
_PRIOR_VARIANCE_PX2 = 1.5
_PRIOR_SHIFT_PX = 0.3


@dataclass(frozen=True, slots=True)
class ChromaCorrection:
    """What to add to the chroma expected from luma."""

    shift: Array
    """(blocks, 2) mean of Cb and Cr."""
    swing: Array
    """(blocks, 2, 2) cosine and sine part of Cb and Cr at the stripes' phase."""
    trust: Array
    """(blocks,) share of a colour swing that was seen, 0 to 1."""


def color_lines(colors: BlockColors, transfer: Transfer, ycc_from_rgb: Array) -> tuple[Array, Array]:
    """Nodes of each block's colour line in encoded values.

    Returns:
        luma (b, nodes), increasing, and chroma (b, nodes, 2).
    """
    t = 1.2 * np.linspace(0.0, 1.0, _LINE_NODES) ** 2
    slope = colors.slope / np.maximum(colors.slope.max(axis=1, keepdims=True), 1e-9)
    linear = colors.dark[:, None] + t[:, None] * slope[:, None]
    ycc = encoded_from_linear(linear, transfer).astype(float) @ ycc_from_rgb.T
    return np.maximum.accumulate(ycc[..., 0], axis=1), np.ascontiguousarray(ycc[..., 1:])


def chroma_correction(
    measured: Array, expected: Array, mean_difference: Array, cycles_per_px: Array
) -> ChromaCorrection:
    """Compare measured with expected chroma, block by block.

    Args:
        measured, expected: (b, 2) complex swing of Cb and Cr at the stripes' phase (cosine - i sine).
        mean_difference: (b, 2) measured less expected mean.
        cycles_per_px: (b, 2) frequency of the stripes.
    """
    gain, turn = _channel_of_chroma(measured, expected, cycles_per_px)
    # a Wiener filter: undo the attenuation as far as the swing stands out of the codec's noise
    power = np.mean(np.abs(measured) ** 2, axis=1) + gain**2 * np.mean(np.abs(expected) ** 2, axis=1)
    seen = gain / (gain**2 + _SWING_NOISE**2 / np.maximum(power, 1e-12))
    missing = (measured * turn[:, None] - gain[:, None] * expected) * seen[:, None]
    patterned = np.any(cycles_per_px != 0.0, axis=1)
    missing = np.where(patterned[:, None], missing, 0.0)
    return ChromaCorrection(mean_difference, np.stack([missing.real, -missing.imag], axis=-1), gain * seen)


def _channel_of_chroma(measured: Array, expected: Array, cycles_per_px: Array) -> tuple[Array, NDArray[np.complex128]]:
    """Attenuation (b,) of chroma swings, and the unit factor (b,) that undoes chroma's displacement."""
    power = np.sum(np.abs(expected) ** 2, axis=1)
    cross = np.sum(measured * expected.conj(), axis=1)
    frequency = np.sum(cycles_per_px**2, axis=1)
    strong = (power > (1.5 / 224.0) ** 2) & (frequency > 0.0) & (frequency < 0.2**2)
    ratio = np.where(strong, cross / np.maximum(power, 1e-12), 1.0)
    weight = np.where(strong, power * 224.0**2, 0.0)
    exponent = 2.0 * np.pi**2 * frequency
    fall = np.clip(-np.log(np.maximum(np.abs(ratio), 0.05)), 0.0, 3.0)
    variance = (_PRIOR_VARIANCE_PX2 + np.sum(weight * exponent * fall)) / (1.0 + np.sum(weight * exponent**2))
    wave = 2.0 * np.pi * cycles_per_px
    angle = np.where(strong & (np.abs(ratio) > 0.25), np.angle(ratio), 0.0)
    normal = (wave * weight[:, None]).T @ wave + np.eye(2) / _PRIOR_SHIFT_PX**2
    shift = np.linalg.solve(normal, (wave * weight[:, None]).T @ angle)
    return np.exp(-exponent * variance), np.exp(-1j * wave @ shift)
