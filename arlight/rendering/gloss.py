"""The glossy lobe: reconstructed radiance blurred by a microfacet lobe, as a small octahedral map linear in the light.

Source: B. Karis, Real Shading in Unreal Engine 4 (2013), the split sum with normal = view = reflection.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.rendering.reconstruction import Reconstruction

Array = NDArray[np.float64]

GLOSS_SIDE = 32


def octahedral_directions(side: int) -> Array:
    """Unit directions (side * side, 3) of an octahedral map's texel centres, row by row; its middle is +z."""
    steps = (np.arange(side) + 0.5) / side * 2.0 - 1.0
    x, y = np.meshgrid(steps, steps)
    z = 1.0 - np.abs(x) - np.abs(y)
    fold = np.maximum(-z, 0.0)
    directions = np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=-1).reshape(-1, 3)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def octahedral_texels(directions: Array, side: int) -> NDArray[np.int64]:
    """Numbers (d,) of the texels of an octahedral map that directions (d, 3) fall on."""
    x, y, z = (directions / np.abs(directions).sum(axis=1, keepdims=True)).T
    fold = np.maximum(-z, 0.0)
    place = np.stack([x + np.copysign(fold, x), y + np.copysign(fold, y)], axis=-1)
    column, row = np.clip(((place * 0.5 + 0.5) * side).astype(np.int64), 0, side - 1).T
    return np.asarray(row * side + column)


def gloss_rows(reconstruction: Reconstruction, roughness: float, side: int = GLOSS_SIDE) -> NDArray[np.float32]:
    """Rows (side * side, m) of the radiance that a lobe about each texel's direction averages.

    Args:
        reconstruction: the matrix from coefficients to radiance.
        roughness: perceptual roughness, the square root of the GGX width; in [0.05, 1].
        side: texels along a side of the map.
    """
    if not 0.05 <= roughness <= 1.0:
        raise ValueError(f"roughness must lie in [0.05, 1], found {roughness}")
    reflected = octahedral_directions(side)
    upper = reconstruction.directions
    sky = _lobe(reflected @ upper.T, roughness)
    # the lower half is uniform: its quadrature is the upper one's mirror image, and only its sum counts
    ground = _lobe(reflected @ (upper * [1.0, 1.0, -1.0]).T, roughness).sum(axis=1, keepdims=True)
    total = sky.sum(axis=1, keepdims=True) + ground
    rows = (sky @ reconstruction.rows + ground * reconstruction.ground_radiance_row) / total
    return rows.astype(np.float32)


def _lobe(cosine: Array, roughness: float) -> Array:
    """GGX weight of light at an angle to the mirror direction, up to a factor."""
    alpha_squared = roughness**4
    half_cosine_squared = (1.0 + cosine) / 2.0
    spread = half_cosine_squared * (alpha_squared - 1.0) + 1.0
    return np.maximum(cosine, 0.0) / spread**2
