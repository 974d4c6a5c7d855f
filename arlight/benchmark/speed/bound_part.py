"""How close a single frame's estimate comes to the Cramer-Rao bound where noise of known size is its only error.

The rows of a filmed frame are replaced by what the sheet's response says they are under the true light, plus noise:
what is left between error and bound is what the estimator gives away.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.playback import FilmedClip
from arlight.estimation.bound import CramerRaoBound
from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.fourier import frequency_order, pack_real
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter

Array = NDArray[np.float64]

_GREEN = 1
"""The channel that is told by its own rows: red and blue also lean on green through their colour lines."""
_SETTLING = 20
"""Frames until blur and reflection have been found."""
_BLUR_VARIANCE_PX2 = 0.4
_SEED = 11


def measure_bound(clip: FilmedClip, frames: int, pixel_noise: float = 0.012) -> Findings:
    """rms error of green, orders 1 and up, of single frames, over the bound's.

    Args:
        clip: gives the view of the sheet and the true light.
        frames: how many are drawn, after settling.
        pixel_noise: standard deviation of a pixel in linear light, 1 is full scale.
    """
    probe, truth = clip.probe, clip.truth[0]
    seen = BlockMeter(probe, clip.camera).measure(clip.frames[0], truth.pose, float(np.sqrt(_BLUR_VARIANCE_PX2)))
    seen = replace(seen, pixel_variance=np.full_like(seen.pixel_variance, pixel_noise**2))
    ideal = _ideal_rows(seen, BlockResponse(probe), truth.coefficients)
    estimator, nuisance, squares = LightingEstimator(probe), None, []
    noise = np.random.default_rng(_SEED)
    for frame in range(_SETTLING + frames):
        estimate = estimator.estimate(_noisy(ideal, noise), 0.0, nuisance)
        nuisance = estimate.nuisance
        if frame >= _SETTLING:
            squares.append(np.abs(estimate.lighting.coefficients - truth.coefficients)[:, _GREEN] ** 2)
    error = np.mean(squares, axis=0)
    bound = CramerRaoBound(probe).stddev(seen, seen.pixel_variance, _BLUR_VARIANCE_PX2)[:, _GREEN] ** 2
    orders = frequency_order(probe.frequencies)
    by_order = [float(np.sqrt(error[orders == k].mean() / bound[orders == k].mean())) for k in np.unique(orders)]
    together = float(np.sqrt(error[orders > 0].mean() / bound[orders > 0].mean()))
    found = Findings(errors={"light of one frame over its bound": together})
    found.details["bound"] = {"together": together, "by_order": by_order, "frames": frames}
    return found


def _ideal_rows(seen: BlockMeans, response: BlockResponse, coefficients: NDArray[np.complex128]) -> BlockMeans:
    """The rows of every block as the response has them under a light, nothing mirrored."""
    packed = pack_real(coefficients)
    shape = packed[:, _GREEN] / packed[0, _GREEN]
    places = response.places
    known = packed[places]
    known[places[:, 1] == 0, 1:] = 0.0
    values = np.einsum("brk,bkc->brc", response.light(seen, shape), known)
    values *= optical_transfer(seen.cycles_per_px, _BLUR_VARIANCE_PX2)[..., None]
    return replace(seen, values=_resolved(values, seen))


def _noisy(ideal: BlockMeans, generator: np.random.Generator) -> BlockMeans:
    """The rows with the noise of their pixels, correlated within a block as its samples make them."""
    noise = np.zeros_like(ideal.values)
    for block in np.flatnonzero(ideal.valid):
        rows = 1 + 2 * int(ideal.harmonics[block])
        root = np.linalg.cholesky(ideal.covariance[block, :rows, :rows])
        noise[block, :rows] = root @ generator.standard_normal((rows, 3)) * np.sqrt(ideal.pixel_variance[block])
    return replace(ideal, values=_resolved(ideal.values + noise, ideal))


def _resolved(values: Array, means: BlockMeans) -> Array:
    """Rows of harmonics that a block does not resolve are 0."""
    row = np.arange(values.shape[1])
    return np.where((row < 1 + 2 * means.harmonics[:, None])[..., None] & means.valid[:, None, None], values, 0.0)
