"""Light from the shading of a matte ball: the linear inverse problem of spherical harmonics up to order 2.

Source: R. Ramamoorthi and P. Hanrahan, On the relationship between radiance and irradiance (2001): a matte surface's
irradiance holds hardly more than nine coefficients of the light.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.calibration.ball.ball_outline import MirrorGeometry, camera_rays
from arlight.calibration.ball.mirror_ball import BallPicture

Array = NDArray[np.float64]

_COSINE_LOBE = np.array([np.pi] + [2.0 * np.pi / 3.0] * 3 + [np.pi / 4.0] * 5)
"""What a cosine lobe leaves of each harmonic."""
_USED_RADIUS = 0.96
"""Share of the outline's angle within which shading is used."""
_MOST_PIXELS = 6000
_RIDGE = 1e-6


def matte_ball_light(picture: BallPicture, reflectance: float) -> Array:
    """Coefficients (9, 3) of the light's spherical harmonics, probe frame, in the order of `harmonics`.

    Args:
        picture: of the ball, linear; clipped pixels are left out.
        reflectance: of the ball.
    """
    rows, columns = np.nonzero(~picture.clipped)
    away, _ = picture.outline.polar(_rays_of(picture, columns, rows))
    inside = np.flatnonzero(away < _USED_RADIUS * picture.outline.half_angle_rad)
    chosen = inside[:: max(1, len(inside) // _MOST_PIXELS)]
    rows, columns = rows[chosen], columns[chosen]
    normals, _ = MirrorGeometry(picture.outline).surface(_rays_of(picture, columns, rows))
    irradiance = picture.radiance[rows, columns].astype(float) * np.pi / reflectance
    design = harmonics(normals @ picture.camera_from_probe.rotation) * _COSINE_LOBE
    gram = design.T @ design
    ridge = _RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
    return np.linalg.solve(gram + ridge, design.T @ irradiance)


def harmonics(directions: ArrayLike) -> Array:
    """Real spherical harmonics (n, 9) of orders 0 to 2 at unit directions (n, 3)."""
    x, y, z = np.moveaxis(np.asarray(directions, float), -1, 0)
    return np.stack(
        [
            np.full_like(x, 0.5 / np.sqrt(np.pi)),
            np.sqrt(0.75 / np.pi) * y,
            np.sqrt(0.75 / np.pi) * z,
            np.sqrt(0.75 / np.pi) * x,
            np.sqrt(3.75 / np.pi) * x * y,
            np.sqrt(3.75 / np.pi) * y * z,
            np.sqrt(0.3125 / np.pi) * (3.0 * z**2 - 1.0),
            np.sqrt(3.75 / np.pi) * x * z,
            np.sqrt(0.9375 / np.pi) * (x**2 - y**2),
        ],
        axis=-1,
    )


def _rays_of(picture: BallPicture, columns: NDArray[np.int64], rows: NDArray[np.int64]) -> Array:
    return camera_rays(picture.camera, np.stack([columns, rows], axis=-1).astype(float))
