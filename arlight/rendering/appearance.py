"""How much of an object's picture the light's coefficients make: which order an object needs."""

import ctypes
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.estimation.prior import prior_stddev
from arlight.estimation.radiance_prior import hemisphere_points
from arlight.fourier import frequency_order
from arlight.native import address, library
from arlight.rendering.gloss import octahedral_texels
from arlight.rendering.mesh import Mesh
from arlight.rendering.transfer import Transfer, harmonics

Array = NDArray[np.float64]

_VIEWS = 16
_SHEET_REFLECTANCE = 0.5
"""Of what the shadow falls on: half of a printed sheet is dark."""
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_gloss_albedos = library(__file__, "shading").gloss_albedos
_gloss_albedos.restype = None
_gloss_albedos.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_double, ctypes.c_double, ctypes.c_void_p]


@dataclass(frozen=True, slots=True)
class Appearance:
    """The squared radiance of an object and its shadow as a quadratic form of the light's coefficients."""

    frequencies: NDArray[np.int64]
    """(k, 2) of the light, (0, 0) first."""
    gram: Array
    """(m, m) Q, m = 2k - 1: x^T Q x is the squared radiance that one channel's real-packed coefficients x make,
    averaged over what is seen from above; of an error of x, the mean squared error of the picture."""

    def energy_by_order(self) -> Array:
        """What each order of natural light, whose spectrum is known before anything is measured, adds to the picture.

        Returns:
            (orders + 1,) shares of the squared radiance, which sum to 1. The root of the sum over the orders beyond n
            is about the relative rms error of a picture made with the light up to order n.
        """
        packed_order = np.repeat(frequency_order(self.frequencies), 2)[1:]
        stddev = prior_stddev(self.frequencies, 1.0)
        # the spectrum is relative to the mean light, which is always there
        stddev[0] = 1.0
        energy = np.bincount(packed_order, np.diag(self.gram) * stddev**2)
        return np.asarray(energy / energy.sum(), float)

    def relative_error(self, covariance: ArrayLike, packed: ArrayLike) -> float:
        """Rms error of the picture over its rms radiance, from the error of one channel's light.

        Args:
            covariance: (j, j) of the first real-packed coefficients.
            packed: (j,) the coefficients themselves.
        """
        error, light = np.asarray(covariance, float), np.asarray(packed, float)
        q = self.gram[: len(light), : len(light)]
        return float(np.sqrt(np.sum(q * error) / (light @ q @ light)))


def appearance(
    mesh: Mesh,
    transfer: Transfer,
    gloss_rows: NDArray[np.float32],
    roughness: float,
    normal_reflectance: float,
    frequencies: NDArray[np.int64],
) -> Appearance:
    """Average over views from above, body, gloss and shadow together; one part's hiding another is not counted.

    Args:
        mesh: placed, probe frame [mm].
        transfer: the mesh's own.
        gloss_rows: (side * side, m) of the octahedral map of lobe-averaged radiance.
        roughness: of the gloss, in [0.05, 1].
        normal_reflectance: Fresnel reflectance at normal incidence.
        frequencies: (k, 2) of the light.
    """
    area, colour = _vertex_areas_mm2(mesh), mesh.base_colour @ _LUMINANCE
    gram = np.zeros((transfer.vertex_rows.shape[1],) * 2)
    side, seen_mm2 = math.isqrt(len(gloss_rows)), 0.0
    for view in hemisphere_points(_VIEWS):
        cosine = mesh.normals @ view
        front = cosine > 0.0
        normals, toward = mesh.normals[front], cosine[front].astype(np.float32)
        mirrored = 2.0 * toward[:, None] * normals - view
        share = np.empty_like(toward)
        _gloss_albedos(address(toward, np.float32), len(toward), roughness, normal_reflectance, share.ctypes.data)
        open_way = np.clip(np.sum(transfer.openness[front] * harmonics(mirrored), axis=1), 0.0, 1.0)
        gloss = (share * open_way)[:, None] * gloss_rows[octahedral_texels(mirrored, side)]
        rows = (colour[front] * (1.0 - share))[:, None] * transfer.vertex_rows[front] + gloss
        weight = area[front] * toward / _VIEWS
        gram += (rows.T * weight) @ rows
        seen_mm2 += float(weight.sum())
    # the plane is seen under a mean cosine of a half
    shadow_rows = _SHEET_REFLECTANCE / np.pi * transfer.shadow.hidden_rows
    gram += 0.5 * transfer.shadow.grid.texel_mm**2 * (shadow_rows.T @ shadow_rows)
    return Appearance(frequencies, gram / seen_mm2)


def _vertex_areas_mm2(mesh: Mesh) -> Array:
    corners = mesh.vertices_mm[mesh.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    shares = np.bincount(mesh.faces.reshape(-1), np.repeat(area / 3.0, 3), minlength=len(mesh.vertices_mm))
    return np.asarray(shares, float)
