"""Radiance from one picture's coefficients, each believed as far as its error bar says.

`reconstruct` is one constant matrix, C A^T (G + N)^-1 with G = A C A^T and a typical noise N, right for light that was
averaged over many frames. In a single picture lamps mirrored in the film hide blocks, and some coefficients are hardly
known; the best linear estimate then has their covariance S beside N, which is the same matrix after the coefficients
went through (G + N)(G + N + S)^-1.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.ball.mirror_ball import MapGrid
from arlight.estimation.lighting import Lighting
from arlight.fourier import pack_real
from arlight.probe.design import Probe
from arlight.rendering.reconstruction import received_operator, reconstruct

Array = NDArray[np.float64]

_CHUNK = 2048


class SheetLight:
    """Maps of radiance from a sheet's estimates.

    Args:
        probe: the sheet.
        grid: of the maps.
    """

    def __init__(self, probe: Probe, grid: MapGrid) -> None:
        self._grid = grid
        reconstruction = reconstruct(probe.slab, probe.frequencies)
        directions = grid.directions().reshape(-1, 3)
        # a part at a time: the prior between all directions is large
        parts = [directions[start : start + _CHUNK] for start in range(0, len(directions), _CHUNK)]
        self._rows = np.concatenate([reconstruction.radiance_rows(part) for part in parts])
        area = np.full(len(reconstruction.directions), reconstruction.solid_angle_sr)
        operator = received_operator(probe.slab, probe.frequencies, reconstruction.directions, area)
        # coefficients of what is reconstructed: G (G + N)^-1, whence G in units of N
        returned = operator @ reconstruction.rows
        identity = np.eye(len(returned))
        prior = np.linalg.solve(identity - returned, returned)
        self._prior_and_noise = 0.5 * (prior + prior.T) + identity

    def radiance(self, lighting: Lighting) -> NDArray[np.float32]:
        """(rows, 2 rows, 3) radiance all around, the ground's below the horizon as `reconstruct` assumes it."""
        packed = pack_real(lighting.coefficients)
        believed = np.stack([self._believed(packed[:, c], lighting.covariance[c]) for c in range(3)], axis=1)
        return (self._rows @ believed).reshape(self._grid.rows, -1, 3).astype(np.float32)

    def _believed(self, packed: Array, covariance: Array) -> Array:
        level = packed[0] ** 2 / self._prior_and_noise[0, 0]
        return self._prior_and_noise @ np.linalg.solve(self._prior_and_noise + covariance / level, packed)
