"""From the received lighting's coefficients back to radiance: one constant matrix.

The coefficients are integrals of the radiance l over the upper hemisphere, L~ = A l, with a known smooth operator A.
Dividing the synthesised l~ by its weight amplifies what hardly reaches the paper, so l is instead reconstructed as the
best linear estimate under a smooth isotropic prior,

    l^ = R L~,   R = C A^T (A C A^T + S)^-1,   C(w, w') = c0 + c1 exp(-angle(w, w') / a)

R does not depend on the light's scale: S is a fixed share of the prior's own L~_0. Light from below the sheet is never
seen; it is ASSUMED: the surroundings send up albedo/pi times the irradiance that falls on them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.estimation.independent_parts import completed
from arlight.estimation.radiance_prior import (
    observed_covariance,
    radiance_covariance,
    received_operator,
    sky_covariance,
    sky_directions,
)
from arlight.optics import Slab

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Reconstruction:
    """The linear map from real-packed coefficients (m = 2k - 1) to radiance; rows are meant as `rows @ packed`."""

    directions: Array
    """(n, 3) equal-area quadrature directions of the upper hemisphere, toward the light."""
    rows: Array
    """(n, m) matrix R: radiance from `directions` per coefficient [1/sr]."""
    prior_weights: Array
    """(n, m) A^T (A C A^T + S)^-1, from which the row of any direction follows."""
    independent: Array
    """(m, m) lower triangle L, L L^T = A C A^T + S: coefficients are L times independent parts of unit variance, and
    the first of these follow from the first of those."""
    surroundings_albedo: float
    """Assumed albedo of what lies around and under the object, in [0, 1]."""

    @property
    def solid_angle_sr(self) -> float:
        """Solid angle that each of `directions` stands for [sr]."""
        return 2.0 * np.pi / len(self.directions)

    @property
    def upward_irradiance_row(self) -> Array:
        """(m,) irradiance on the open, upward-facing plane, nothing in front of it."""
        return self.solid_angle_sr * self.directions[:, 2] @ self.rows

    @property
    def ground_radiance_row(self) -> Array:
        """(m,) assumed radiance from every direction below the horizon."""
        return self.surroundings_albedo / np.pi * self.upward_irradiance_row

    def completed(self, packed: ArrayLike) -> Array:
        """All coefficients (m, 3) that the first ones (k, 3) predict; theirs stay as they are.

        What is reconstructed of these is the best estimate from the first ones alone, as `reconstruct` for them has it.
        """
        return completed(self.independent, np.asarray(packed, float))

    def radiance_rows(self, directions: ArrayLike) -> Array:
        """Radiance rows (d, m) of any unit directions (d, 3); the ground's below the horizon."""
        w = np.asarray(directions, float)
        upper = radiance_covariance(w, self.directions) @ self.prior_weights
        return np.where(w[:, 2:] >= 0.0, upper, self.ground_radiance_row)

    def irradiance_rows(self, normals: ArrayLike) -> Array:
        """Irradiance rows (d, m) of unoccluded surfaces with the unit normals (d, 3), sky and ground together."""
        n = np.asarray(normals, float)
        # single precision: a large product of bounded, well-scaled numbers
        cosine = np.maximum(n.astype(np.float32) @ self.directions.T.astype(np.float32), 0.0)
        sky = self.solid_angle_sr * (cosine @ self.rows.astype(np.float32)).astype(float)
        # form factor of the lower hemisphere, in closed form
        ground = np.pi * (1.0 - n[:, 2:]) / 2.0
        return sky + ground * self.ground_radiance_row


def reconstruct(slab: Slab, frequencies: ArrayLike, surroundings_albedo: float = 0.3) -> Reconstruction:
    """Build R for a sheet's glass and a set of frequencies.

    Args:
        slab: the glass that the coefficients belong to.
        frequencies: (k, 2) integers, (0, 0) first.
        surroundings_albedo: assumed albedo of the surroundings, in [0, 1]; 0.3 lies between a printed sheet, half of
            it dark, and a light table.
    """
    if not 0.0 <= surroundings_albedo <= 1.0:
        raise ValueError(f"surroundings_albedo must lie in [0, 1], found {surroundings_albedo}")
    directions, solid_angle_sr = sky_directions()
    operator = received_operator(slab, frequencies, directions, solid_angle_sr)
    told = sky_covariance() @ operator.T
    observed = observed_covariance(operator @ told)
    weights = np.asarray(np.linalg.solve(observed, operator).T, float)
    rows = np.asarray(np.linalg.solve(observed, told.T).T, float)
    independent = np.asarray(np.linalg.cholesky(observed), float)
    return Reconstruction(directions, rows, weights, independent, surroundings_albedo)
