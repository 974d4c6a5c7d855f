"""Coefficients at whole frequencies from those at the frequencies that an assembled sheet really measures.

Stripes keep the period they were printed with. On glass of another thickness, or turned with the film, they measure
the light's transform between the whole frequencies. The transform is smooth, for all light lies within a disk of
diameter 1, so the whole frequencies follow by linear prediction under the prior of natural light.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.radiance_prior import predicted_sky, received_operator, sky_covariance, sky_directions
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Resampling:
    """Linear prediction of the coefficients at the sheet's whole frequencies (m = 2k - 1 real unknowns)."""

    matrix: Array
    """(m, m): whole-frequency coefficients from the measured ones, real-packed."""
    missing: Array
    """(m, m) covariance of what no measured coefficient tells, for L~_0 = 1."""

    def apply(self, packed: Array, covariance: Array) -> tuple[Array, Array]:
        """Coefficients (..., m) at whole frequencies with their covariance (..., m, m)."""
        values = packed @ self.matrix.T
        # seven digits of a covariance are plenty; `missing` keeps it positive definite
        matrix = self.matrix.astype(np.float32)
        spread = matrix @ covariance.astype(np.float32) @ matrix.T
        return values, spread + self.missing * values[..., :1, None] ** 2


def measured_frequencies(probe: Probe, assembly: Assembly) -> Array:
    """(k, 2) frequencies in the light plane of the assembled glass that the sheet's stripes have."""
    cycles = assembly.film.registration.cycles_per_mm(probe.frequencies / probe.slab.period_mm)
    return np.asarray(cycles * assembly.slab(probe).period_mm, float)


def resampling(probe: Probe, assembly: Assembly, count: int | None = None) -> Resampling | None:
    """Build the prediction for a sheet, or for its first `count` frequencies; None when its stripes have whole ones."""
    measured, whole = measured_frequencies(probe, assembly)[:count], probe.frequencies[:count]
    if np.allclose(measured, whole, atol=1e-9):
        return None
    slab = assembly.slab(probe)
    seen, wanted = (received_operator(slab, frequencies, *sky_directions()) for frequencies in (measured, whole))
    matrix = wanted @ predicted_sky(slab, measured)
    told = sky_covariance() @ wanted.T
    missing = (wanted @ told - matrix @ (seen @ told)) / (wanted[0] @ told[:, 0])
    return Resampling(np.asarray(matrix, float), np.asarray(0.5 * (missing + missing.T), float))
