"""What varies smoothly over a picture, at every pixel's centre, from its values at a coarse grid of places."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CELLS = 128
"""Cells across the picture: a lens's rays then come out to 1e-3 px, for usual lenses to 1e-4 px."""


def over_pixels(function: Callable[[Array], Array], size: tuple[int, int]) -> NDArray[np.float32]:
    """A smooth function of the place in the picture, by cubic interpolation between few places.

    Args:
        function: its values (n, c) at places (n, 2) in pixels, up to a cell outside the picture.
        size: (width, height) of the picture [px].

    Returns:
        (height, width, c) values at the pixels' centres, which lie at integers.
    """
    width, height = size
    cell_px = max(1.0, max(size) / _CELLS)
    across, x = _interpolation(width, cell_px)
    down, y = _interpolation(height, cell_px)
    values = function(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    rows = across @ values.reshape(len(y), len(x), -1)
    return (down @ rows.reshape(len(y), -1)).reshape(height, width, -1).astype(np.float32)


def _interpolation(count: int, cell_px: float) -> tuple[Array, Array]:
    """Matrix (count, n) from values at n places to values at the pixels 0 to count - 1, and those places [px]."""
    place = np.arange(count) / cell_px
    cells = max(1, int(np.ceil(place[-1])))
    first = np.minimum(place.astype(int), cells - 1)
    t = place - first
    # Lagrange's polynomials through the places -1, 0, 1 and 2 of each cell
    before, after = t * (t - 1.0), (t + 1.0) * (t - 2.0)
    weights = np.stack([-before * (t - 2.0) / 6.0, after * (t - 1.0) / 2.0, -after * t / 2.0, before * (t + 1.0) / 6.0])
    matrix = np.zeros((count, cells + 3))
    matrix[np.arange(count), first + np.arange(4)[:, None]] = weights
    return matrix, np.asarray((np.arange(cells + 3) - 1.0) * cell_px, float)
