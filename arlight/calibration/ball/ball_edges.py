"""Edges across the contour of a ball, to a fraction of a pixel."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.calibration.ball.ball_outline import BallOutline, project_rays
from arlight.camera import Camera

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

CONTOUR_POINTS = 240
"""Directions around the axis in which edges are looked for."""
_STEP_PX = 0.5
_LEAST_REACH_PX = 3.0
_LEAST_SLOPE = 0.006
"""Of the contrast picture, per pixel: three times the noise of a good exposure."""
_LEAST_ALIGNMENT = 0.9
"""Cosine of the largest angle between an edge's gradient and the line from the ball's middle."""


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Places where brightness changes across a cone."""

    rays: Array
    """(n, 3) unit rays to the edges, camera frame."""
    direction: NDArray[np.int64]
    """(n,) in which of the directions around the axis each was found."""
    strength: Array
    """(n,) how fast brightness changes there [1/px]."""
    px_per_rad: float
    """Pixels for an angle at the ball."""


def find_edges(picture: Picture, camera: Camera, outline: BallOutline, reach: float) -> Edges:
    """Every edge near an outline, several in a direction where there are.

    Args:
        picture: (h, w), smooth enough that an edge is more than a pixel wide.
        camera: that took it.
        outline: where to look.
        reach: how far from the outline, relative to its radius.
    """
    around = np.linspace(0.0, 2.0 * np.pi, CONTOUR_POINTS, endpoint=False)
    _, radius = outline.circle_px(camera)
    reach_px = max(reach * radius, _LEAST_REACH_PX)
    px_per_rad = radius / outline.half_angle_rad
    away = outline.half_angle_rad + np.arange(-reach_px, reach_px + _STEP_PX, _STEP_PX) / px_per_rad
    pixels = project_rays(camera, outline.rays_at(*np.meshgrid(away, around)).reshape(-1, 3))
    pixels = pixels.reshape(CONTOUR_POINTS, len(away), 2)
    slope, aligned = _slopes(picture, pixels)
    left, middle, right = slope[:, :-2], slope[:, 1:-1], slope[:, 2:]
    peaks = (middle >= left) & (middle > right) & (middle > _LEAST_SLOPE) & aligned[:, 1:-1]
    row, column = np.nonzero(peaks)
    curvature = np.minimum(left[peaks] - 2.0 * middle[peaks] + right[peaks], -1e-12)
    shift = np.clip(0.5 * (left[peaks] - right[peaks]) / curvature, -0.5, 0.5)
    at = away[column + 1] + shift * _STEP_PX / px_per_rad
    return Edges(outline.rays_at(at, around[row]), row, middle[peaks], px_per_rad)


def _slopes(picture: Picture, pixels: Array) -> tuple[Array, NDArray[np.bool_]]:
    """How fast brightness changes along rows of pixels (m, n, 2) [1/px], and where it changes mainly along them."""
    place = pixels.astype(np.float32)
    x0, y0 = np.floor(place.min(axis=(0, 1))).astype(int) - 3
    x1, y1 = np.ceil(place.max(axis=(0, 1))).astype(int) + 4
    height, width = picture.shape
    x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)
    if x1 - x0 < 3 or y1 - y0 < 3:
        return np.zeros(place.shape[:2]), np.zeros(place.shape[:2], bool)
    part = picture[y0:y1, x0:x1]
    gradient: Picture = np.dstack([cv2.Scharr(part, cv2.CV_32F, 1, 0), cv2.Scharr(part, cv2.CV_32F, 0, 1)]).astype(
        np.float32
    )
    sampled = cv2.remap(
        gradient, place[..., 0] - np.float32(x0), place[..., 1] - np.float32(y0), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
    ).astype(float) / 32.0  # fmt: skip
    outward = np.gradient(pixels, axis=1)
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    along = np.abs(np.sum(sampled * outward, axis=2))
    return along, along > _LEAST_ALIGNMENT * np.linalg.norm(sampled, axis=2)
