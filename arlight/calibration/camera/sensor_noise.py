"""The camera's noise and clipping level, from patches of even tone."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from arlight.calibration.camera.paper_samples import PaperSamples
from arlight.radiometry import Radiometry
from arlight.video.frame import Frame

Array = NDArray[np.float64]

_LEAST_PIXELS = 25
_GREEN = 1
_NO_PILE_CLIP = 0.94
"""Light taken for clipped where nothing in the pictures shows the clipping level."""
_BELOW_PILE = 0.97
"""Light taken for clipped, relative to where clipped pixels pile up: codecs ring around true white."""
_LOWEST_PILE = 0.85
_PILE = 8.0
_PILE_SHARE = 2e-4


def fit_noise(samples: Sequence[PaperSamples], radiometry: Radiometry) -> tuple[float, float]:
    """Read noise (standard deviation) and shot gain (variance per unit) of one channel, in light.

    A third part that grows with the square of the light, the paper's own texture, is told apart and left out. What the
    codec smoothed away is not noise any more and is not counted.

    Args:
        samples: of some pictures.
        radiometry: decodes them.
    """
    means, variances = [], []
    for picture in samples:
        labels = np.where(picture.patch >= 0, picture.patch, 1000 + picture.sector)
        light = radiometry.linear(picture.encoded[:, _GREEN])
        for label in np.unique(labels):
            own = labels == label
            if np.count_nonzero(own) >= _LEAST_PIXELS and light[own].max() < radiometry.clip:
                means.append(float(np.mean(light[own])))
                variances.append(_variance_beside_a_plane(picture.points_mm[own], light[own]))
    if len(means) < 3:
        return 0.0, 0.0
    mean, variance = np.maximum(means, 0.0), np.array(variances)
    parts = np.stack([np.ones_like(mean), mean, mean**2], axis=1)
    expected = variance
    for _ in range(3):
        weight = 1.0 / np.maximum(expected, 1e-9)
        solved, _ = nnls(parts * weight[:, None], variance * weight)
        expected = parts @ solved
    return float(np.sqrt(solved[0])), float(solved[1])


def clipping_level(frames: Sequence[Frame], radiometry: Radiometry) -> float:
    """Light from which pixels count as clipped: a little below where the brightest codes pile up.

    Args:
        frames: pictures of one format.
        radiometry: decodes them.
    """
    counts = np.zeros(256)
    for frame in frames:
        counts += np.bincount(frame.luma().ravel(), minlength=256)
    top = int(np.max(np.flatnonzero(counts), initial=0))
    pile = counts[max(top - 1, 0) : top + 1].sum()
    before = counts[max(top - 11, 0) : max(top - 1, 0)].mean() if top > 11 else np.inf
    if top / 255.0 < _LOWEST_PILE or pile < _PILE * max(before, 1.0) or pile < _PILE_SHARE * counts.sum():
        return _NO_PILE_CLIP
    return float(np.clip(_BELOW_PILE * radiometry.linear(top / 255.0), 0.05, 1.0))


def _variance_beside_a_plane(points: Array, values: Array) -> float:
    """Variance of values around their own slope, robust against single odd ones."""
    design = np.column_stack([np.ones(len(points)), points - points.mean(axis=0)])
    residual = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    spread = 1.4826 * np.median(np.abs(residual))
    kept = residual[np.abs(residual) <= 4.0 * spread] if spread > 0.0 else residual
    return float(np.sum(kept**2) / max(len(kept) - 3, 1))
