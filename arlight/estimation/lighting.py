"""The lighting value: Fourier coefficients of the received light with their covariance."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.fourier import orders_up_to


@dataclass(frozen=True, slots=True)
class Lighting:
    """Low-order Fourier coefficients of the light that the sheet receives, with error bars."""

    frequencies: NDArray[np.int64]
    """(k, 2) frequencies (u, v), (0, 0) first."""
    coefficients: NDArray[np.complex128]
    """(k, 3) coefficients L~_n of the received lighting, linear RGB [radiance * sr]."""
    covariance: NDArray[np.float64]
    """(3, 2k - 1, 2k - 1) covariance of (L_0, Re L_1, Im L_1, ...) for each channel [(radiance * sr)^2]."""
    time_s: float
    """Time of the frame it belongs to [s]."""
    chi2: float
    """Residual chi-square per degree of freedom of the frame's blocks; nan where no block was seen."""

    @property
    def order(self) -> int:
        """Highest order |n| in use."""
        # the smallest integer not below the root, in integers: it is asked for in every frame
        squared = int(np.einsum("ij,ij->i", self.frequencies, self.frequencies).max())
        return math.isqrt(squared - 1) + 1 if squared else 0

    def truncated(self, order: int) -> "Lighting":
        """The same light with the frequencies up to an order alone; what is left keeps its error bars.

        Args:
            order: 0 or more, not beyond the lighting's own.

        Raises:
            ProbeError: the lighting does not reach the order.
        """
        kept = orders_up_to(self.frequencies, order)
        packed = np.repeat(kept, 2)[1:]
        return replace(
            self,
            frequencies=self.frequencies[kept],
            coefficients=self.coefficients[kept],
            covariance=self.covariance[:, packed][:, :, packed],
        )

    def scaled(self, factor: NDArray[np.float64]) -> "Lighting":
        """The same light as another exposure records it, each channel multiplied by its factor (3,)."""
        return replace(
            self,
            coefficients=self.coefficients * factor,
            covariance=self.covariance * factor[:, None, None] ** 2,
        )

    @property
    def stddev(self) -> NDArray[np.float64]:
        """(k, 3) standard deviation of |L~_n|'s error: sqrt(var Re + var Im) [radiance * sr]."""
        variance = np.diagonal(self.covariance, axis1=1, axis2=2).T
        total = np.empty((len(self.frequencies), 3))
        total[0] = variance[0]
        total[1:] = variance[1::2] + variance[2::2]
        return np.sqrt(np.maximum(total, 0.0))
