"""How bright a picture shows the frame's white paper: what automatic exposure and white balance change together.

Exposure and the light's own brightness are one product in a picture. What can be said is how the level of each channel
goes from frame to frame; a filter that is told so need not take a change of exposure for a change of light.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.paper_samples import PaperSampler, decoded, read_linear
from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.video.frame import Frame

Array = NDArray[np.float64]

_SPACING_MM = 2.2
_CLIP = 0.94
"""Light from which a pixel counts as clipped where the camera's radiometry does not say."""
_FEWEST = 40
_FEWEST_SECTORS = 8
_ROUNDS = 5
_TUNING = 4.7
"""Tukey's biweight: residuals beyond so many standard deviations have no say."""
_SMALLEST_DEVIATION = 0.002


@dataclass(frozen=True, slots=True)
class PaperLevel:
    """White paper in one picture."""

    level: Array
    """(3,) light of the frame's white paper, mean over the frame; nan where it cannot be told."""
    variance: Array
    """(3,) of the level; infinite where it cannot be told."""
    share: float
    """Share of the frame's blank paper that was seen, unclipped and like the rest."""

    @property
    def valid(self) -> bool:
        """Whether all channels have a level."""
        return bool(np.all(np.isfinite(self.level)))


class ExposureMeter:
    """Measures the level of the frame's white paper in frames of one camera.

    Args:
        probe: the sheet.
        camera: intrinsics; its vignetting and radiometry are applied where it has them.

    Raises:
        ProbeError: the sheet's frame has no unprinted paper to speak of.
    """

    def __init__(self, probe: Probe, camera: Camera) -> None:
        self._camera = camera
        self._sampler = PaperSampler(probe, camera, _SPACING_MM)
        self._scale = np.array(probe.sheet_mm) / 2.0
        # the level is the mean over all of the paper, so that it does not depend on which of it is seen
        self._mean = _surface(self._sampler.paper_mm / self._scale).mean(axis=0)

    def measure(self, frame: Frame, pose: Pose) -> PaperLevel:
        """Level of the white paper, with its variance.

        1. Pixels of blank paper, clear of all print, and of the wedge, divided by its reflectance.
        2. A smooth surface through them, robustly: a hand's shadow over a part of the frame has no say.
        3. Its mean over the whole frame. The variance counts parts of the frame, not pixels, as independent.

        The wedge serves only where most of the paper is clipped.

        Args:
            frame: the picture; its size is the camera's.
            pose: camera_from_probe.
        """
        samples = self._sampler.sample(frame, pose)
        light = read_linear(frame, self._camera, samples)
        clip = _CLIP if self._camera.radiometry is None else self._camera.radiometry.clip
        limit = clip * np.minimum(self._camera.gain(samples.pixels), 1.0) ** -1
        surface = _surface(samples.points_mm / self._scale)
        paper = samples.patch < 0
        level, variance, shares = np.full(3, np.nan), np.full(3, np.inf), np.zeros(3)
        for c in range(3):
            clipped = light[:, c] >= limit
            crowded = np.count_nonzero(paper & clipped) > 0.5 * np.count_nonzero(paper)
            used = ~clipped & (paper | (crowded & (samples.reflectance > 0.0)))
            sectors = samples.sector[used]
            if np.count_nonzero(used) < _FEWEST or len(np.unique(sectors)) < _FEWEST_SECTORS:
                continue
            ink = samples.reflectance[used]
            level[c], variance[c], kept = _robust_mean(
                surface[used] * ink[:, None], light[used, c], sectors, self._mean
            )
            variance[c] += _quantisation(level[c], frame, self._camera)
            shares[c] = kept * np.count_nonzero(used) / len(self._sampler.paper_mm)
        return PaperLevel(level, variance, float(min(shares.min(), 1.0)))


def _quantisation(level: float, frame: Frame, camera: Camera) -> float:
    """Variance of a level that all pixels show by the same code, as a codec leaves them: noise does not dither it."""
    step = 1.0 / frame.format.luma_code_range[1]
    encoded = np.linspace(0.0, 1.0, 257)
    light = decoded(encoded, frame, camera)
    slope = np.interp(level, light, np.gradient(light, encoded))
    return float((slope * step) ** 2 / 12.0)


def _surface(position: Array) -> Array:
    """(n, 6) terms of a quadratic surface at positions (n, 2) within [-1, 1]."""
    x, y = position.T
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _robust_mean(terms: Array, values: Array, sectors: NDArray[np.int64], mean: Array) -> tuple[float, float, float]:
    """Mean of a surface through values, its variance (by sectors), and the share of values that had a say."""
    weights = np.ones(len(values))
    for _ in range(_ROUNDS):
        normal = terms.T @ (weights[:, None] * terms) + 1e-9 * len(values) * np.eye(terms.shape[1])
        coefficients = np.linalg.solve(normal, terms.T @ (weights * values))
        residual = values - terms @ coefficients
        deviation = 1.4826 * float(np.median(np.abs(residual)))
        bound = _TUNING * max(deviation, _SMALLEST_DEVIATION * float(np.median(values)), 1e-6)
        weights = np.maximum(1.0 - (residual / bound) ** 2, 0.0) ** 2
    gain = np.linalg.solve(normal, mean)
    # a part's pixels err together: texture, codec, light that is not quite as smooth as the surface
    score = (terms @ gain) * weights * residual
    parts = np.bincount(sectors, weights=score)
    counted = len(np.unique(sectors))
    variance = float(np.sum(parts**2)) * counted / max(counted - terms.shape[1], 1)
    return float(mean @ coefficients), variance, float(np.mean(weights > 0.0))
