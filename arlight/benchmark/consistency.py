"""Whether error bars are honest: the squared error, normalised by the covariance that was reported with it.

e' C^-1 e a degree of freedom averages 1 where C is the covariance of the errors e; more says that error bars are too
narrow, less that they are too wide. Channels are judged one by one, since their covariances are reported so.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.lighting import Lighting
from arlight.fourier import frequency_order, pack_real

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Consistency:
    """Normalised error squared a degree of freedom, over all frames and channels."""

    frames: int
    """How many estimates were judged."""
    full: float
    """Mean of e' C^-1 e / n."""
    spread: float
    """Standard deviation of a frame's e' C^-1 e / n over the frames: an average of 1 may hide both extremes."""
    diagonal: float
    """Mean of e^2 over the reported variances alone."""
    by_order: dict[int, float]
    """The latter, order by order."""


def consistency(estimates: Sequence[Lighting], truths: Sequence[Complex]) -> Consistency:
    """Judge estimates with their full covariance.

    Args:
        estimates: of the same frequencies.
        truths: (k, 3) true coefficients of each estimate's frame, in the order of its frequencies.

    Returns:
        nan everywhere where there are no estimates.
    """
    if not estimates:
        return Consistency(0, *(float("nan"),) * 3, {})
    errors = np.stack([pack_real(e.coefficients - t).T for e, t in zip(estimates, truths, strict=True)])
    covariances = np.stack([estimate.covariance for estimate in estimates])
    full = np.mean(errors * np.linalg.solve(covariances, errors[..., None])[..., 0], axis=(1, 2))
    single = errors**2 / np.diagonal(covariances, axis1=2, axis2=3)
    orders = frequency_order(estimates[0].frequencies)
    packed = np.concatenate([orders[:1], np.repeat(orders[1:], 2)])
    by_order = {int(order): float(np.mean(single[..., packed == order])) for order in np.unique(orders)}
    return Consistency(len(estimates), float(full.mean()), float(full.std()), float(single.mean()), by_order)


def logged_consistency(estimated: Complex, stddev: Array, true: Complex) -> float:
    """Mean of |error|^2 over the reported variance, for a log, which keeps no correlations.

    Args:
        estimated, true: (frames, k, 3); stddev: (frames, k, 3) of |error|; frames without an estimate are nan.
    """
    known = np.all(np.isfinite(estimated) & np.isfinite(stddev), axis=(1, 2))
    if not np.any(known):
        return float("nan")
    # order 0 is one real number, the others are two
    freedom = np.where(np.arange(estimated.shape[1]) == 0, 1.0, 2.0)[:, None]
    normalised = np.abs(estimated[known] - true[known]) ** 2 / np.maximum(stddev[known], 1e-30) ** 2
    return float(np.sum(freedom * normalised) / (len(normalised) * freedom.sum() * estimated.shape[2]))
