"""The Cramer-Rao bound: how well any unbiased estimator could do on one frame whose only error is pixel noise.

The view, the blur and the mirror reflection are taken as known, no prior helps: (A' W A)^-1.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.color import encoded_from_linear
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.probe.design import Probe
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]


class CramerRaoBound:
    """Bounds for one sheet."""

    def __init__(self, probe: Probe) -> None:
        self._response = BlockResponse(probe)
        self._count = 2 * len(probe.frequencies) - 1
        self._places = self._response.places
        self._known = np.where(self._places[:, 1] > 0, 3, 1)

    def stddev(self, means: BlockMeans, pixel_variance: Array, blur_variance_px2: float) -> Array:
        """Least standard deviation of each coefficient's error.

        Args:
            means: which pixels were used, from where; their values do not matter.
            pixel_variance: (blocks, 3) variance of a pixel's noise in linear light [full scale squared].
            blur_variance_px2: variance of the picture's blur [px^2].

        Returns:
            (k, 3) sqrt(var Re + var Im) [radiance * sr]; inf for coefficients that no block saw.
        """
        transfer = optical_transfer(means.cycles_per_px, blur_variance_px2)
        design = self._response.light(means) * transfer[..., None]
        information = np.zeros((3, self._count, self._count))
        for i in np.flatnonzero(means.valid):
            rows, known = 1 + 2 * int(means.harmonics[i]), int(self._known[i])
            weight = np.linalg.inv(means.covariance[i, :rows, :rows])
            own = design[i, :rows, :known].T @ weight @ design[i, :rows, :known]
            place = self._places[i, :known]
            information[:, place[:, None], place] += own / pixel_variance[i][:, None, None]
        return _stddev(information)


def _stddev(information: Array) -> Array:
    count = information.shape[1]
    variance = np.full((count, 3), np.inf)
    for channel in range(3):
        seen = np.diagonal(information[channel]) > 0.0
        inverse = np.linalg.pinv(information[channel][np.ix_(seen, seen)], hermitian=True)
        variance[seen, channel] = np.diagonal(inverse)
    return np.sqrt(np.concatenate([variance[:1], variance[1::2] + variance[2::2]]))


def sensor_variance(radiance: Array, read_noise: float, gain: float) -> Array:
    """Variance of a pixel of an 8-bit sRGB picture: read and shot noise, and rounding to whole levels.

    Args:
        radiance: mean linear values, any shape [full scale].
        read_noise: standard deviation in the dark; gain: variance per unit of signal.
    """
    signal = np.clip(radiance, 0.0, 1.0)
    # slope of the sRGB curve's inverse: how much light a level is
    encoded = encoded_from_linear(signal, "srgb").astype(float)
    slope = np.where(encoded <= 0.04045, 1 / 12.92, 2.4 / 1.055 * ((encoded + 0.055) / 1.055) ** 1.4)
    return read_noise**2 + gain * signal + (slope / 255.0) ** 2 / 12.0
