"""Which pictures of a flat target are worth calibrating with: sharp ones that differ from each other."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.camera_fit import TargetView

Array = NDArray[np.float64]

_LEAST_SHARPNESS = 0.6
"""Sharpness, relative to the median of all views, below which a view is left out."""
_ALIKE = 0.012
"""Views whose target moved by less, relative to the picture's diagonal, say the same; their errors are the same too."""


def select_views(
    views: Sequence[TargetView], sharpness: Sequence[float], image_size: tuple[int, int], most: int
) -> list[int]:
    """Indices of sharp views spread as far from each other as can be, in the order of the views.

    1. Views much less sharp than is usual are left out.
    2. From the sharpest on, the view that differs most from those chosen is taken next, until there are enough or the
       rest are like one that was chosen.

    Args:
        views: of the same target.
        sharpness: as `edge_sharpness` measures it, one a view.
        image_size: (width, height) [px].
        most: views to choose at most.
    """
    sharp = np.asarray(sharpness, float)
    shapes = _shapes(views) / np.hypot(*image_size)
    able = (sharp >= _LEAST_SHARPNESS * np.median(sharp)) & np.all(np.isfinite(shapes), axis=1)
    if not able.any():
        return []
    chosen = [int(np.argmax(np.where(able, sharp, -1.0)))]
    while len(chosen) < most:
        apart = np.min(
            [np.sqrt(np.mean((shapes - shapes[k]) ** 2, axis=1) * 2.0) for k in chosen], axis=0, initial=np.inf
        )
        apart = np.where(able, apart, 0.0)
        following = int(np.argmax(apart))
        if not apart[following] > _ALIKE:
            break
        chosen.append(following)
    return sorted(chosen)


def edge_sharpness(luma: NDArray[np.uint8], pixels: Array) -> float:
    """How steep the steepest edges around some points are, relative to the contrast there [1/px].

    Args:
        luma: (h, w) luma codes.
        pixels: (n, 2) points of the target [px].
    """
    low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 8, 0)
    high = np.ceil(pixels.max(axis=0)).astype(int) + 8
    part = np.ascontiguousarray(luma[low[1] : high[1], low[0] : high[0]])
    if min(part.shape) < 8:
        return 0.0
    dark, light = np.quantile(part[::3, ::3], [0.05, 0.95])
    gradient = np.hypot(cv2.Sobel(part, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(part, cv2.CV_32F, 0, 1, scale=0.125))
    return float(np.quantile(gradient, 0.98) / max(light - dark, 1.0))


def _shapes(views: Sequence[TargetView]) -> Array:
    """(views, 8) where the corners of the target's extent are seen [px]; nan where that cannot be told."""
    everything = np.concatenate([view.points_mm for view in views])
    (x0, y0), (x1, y1) = everything.min(axis=0), everything.max(axis=0)
    corners = np.array([[[x0, y0], [x1, y0], [x1, y1], [x0, y1]]], float)
    shapes = np.full((len(views), 8), np.nan)
    for k, view in enumerate(views):
        homography, _ = cv2.findHomography(view.points_mm, view.pixels)
        if homography is not None:
            shapes[k] = cv2.perspectiveTransform(corners, homography).reshape(-1)
    return shapes
