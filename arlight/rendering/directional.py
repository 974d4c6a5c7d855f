"""The light as a few directional lights and an ambient term, for renderers that know nothing else."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from arlight.estimation.radiance_prior import hemisphere_points
from arlight.rendering.reconstruction import Reconstruction

Array = NDArray[np.float64]

_AMBIENT_QUANTILE = 0.25
"""The radiance that this share of the hemisphere stays below is ambient."""
_ITERATIONS = 8
_FITTED_NORMALS = 64
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, slots=True)
class DirectionalLights:
    """Distant lights and uniform light."""

    directions: Array
    """(l, 3) unit vectors toward the lights."""
    irradiance: Array
    """(l, 3) RGB irradiance on a plane that faces each light [radiance * sr]."""
    ambient_radiance: Array
    """(3,) RGB radiance from everywhere."""


def directional_lights(reconstruction: Reconstruction, packed: ArrayLike, count: int = 4) -> DirectionalLights:
    """Cluster the reconstructed radiance above its ambient part into directional lights.

    A light stands for its cluster's vector irradiance. The lights' common scale and the ambient part are then fitted,
    per channel, to the irradiance that the reconstruction gives to normals of the upper hemisphere.

    Args:
        reconstruction: the matrix from coefficients to radiance.
        packed: (m, 3) real-packed coefficients.
        count: lights at most.
    """
    packed = np.asarray(packed, float)
    points = reconstruction.directions
    radiance = np.maximum(reconstruction.rows @ packed, 0.0)
    above = np.maximum(radiance - np.quantile(radiance, _AMBIENT_QUANTILE, axis=0), 0.0)
    excess = above * reconstruction.solid_angle_sr
    centres = _clusters(points, excess @ _LUMINANCE, count)
    label = np.argmax(points @ centres.T, axis=1)
    vectors = np.stack([points[label == i].T @ excess[label == i] for i in range(len(centres))])
    directions = vectors @ _LUMINANCE
    length = np.linalg.norm(directions, axis=1)
    directions, vectors = directions[length > 0.0] / length[length > 0.0, None], vectors[length > 0.0]
    irradiance = np.maximum(np.einsum("ldc,ld->lc", vectors, directions), 0.0)
    normals = hemisphere_points(_FITTED_NORMALS)
    wanted = np.maximum(reconstruction.irradiance_rows(normals) @ packed, 0.0)
    from_lights = np.maximum(normals @ directions.T, 0.0) @ irradiance
    fits = [nnls(np.stack([lights, np.full(_FITTED_NORMALS, np.pi)], -1), total)[0] for lights, total in
            zip(from_lights.T, wanted.T, strict=True)]  # fmt: skip
    scale, ambient = np.array(fits).T
    return DirectionalLights(directions, irradiance * scale, ambient)


def _clusters(directions: Array, weight: Array, count: int) -> Array:
    """Centres (<= count, 3): the brightest spots that keep apart, then a few rounds of spherical k-means."""
    left, chosen = weight.copy(), []
    for _ in range(count):
        # a spot's worth is what lies around it, not one sample
        near = np.clip((directions @ directions[np.argmax(left)] - 0.9) / 0.1, 0.0, 1.0)
        if left.max() <= 0.0:
            break
        chosen.append(directions[np.argmax(left)])
        left = left * (1.0 - near)
    centres = np.array(chosen) if chosen else np.array([[0.0, 0.0, 1.0]])
    for _ in range(_ITERATIONS):
        label = np.argmax(directions @ centres.T, axis=1)
        sums = np.stack([weight[label == i] @ directions[label == i] for i in range(len(centres))])
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        centres = np.where(length > 0.0, sums / np.maximum(length, 1e-300), centres)
    return centres
