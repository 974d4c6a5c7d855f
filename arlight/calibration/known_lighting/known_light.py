"""Known light: an environment's coefficients at the frequencies that an assembled sheet measures, and its mirror image.

The light plane does not depend on the glass's thickness, so the light is gathered on it once; its transform can then be
taken wherever the stripes of a trial assembly lie, also between the whole frequencies.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.camera import Pose
from arlight.environment import Environment
from arlight.fourier import pack_real
from arlight.optics import Slab

Array = NDArray[np.float64]

_GRID = 401
"""Samples across the light plane: at order 10 a lamp's amplitude is right to 0.2 %, at order 5 to 0.05 %."""
_REMEMBERED = 16
"""Sets of frequencies whose coefficients are kept."""
_MIRRORED_PER_SIDE = 7
"""Points along a block's side at which the mirrored environment is read."""


@dataclass(frozen=True)
class KnownLight:
    """The light of one lighting, in the units of the camera unless its exposure is unknown."""

    name: str
    """What to call it in messages."""
    environment: Environment
    """Radiance from every direction, in the sheet's frame."""
    refractive_index: float
    """Of the sheet's glass."""
    _plane: Array = field(init=False, repr=False)
    """(rows, columns, 3) received light on a grid over the light plane [radiance * sr]."""
    _known: dict[bytes, Array] = field(init=False, repr=False, compare=False)
    """Coefficients by the frequencies that they were last asked for at: most trial assemblies share theirs."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "_plane", _gathered(self.environment, Slab(refractive_index=self.refractive_index)))
        object.__setattr__(self, "_known", {})

    def packed(self, frequencies: ArrayLike) -> Array:
        """Real-packed coefficients L~ (2k - 1, 3) at frequencies (k, 2), (0, 0) first, not necessarily whole."""
        wanted = np.ascontiguousarray(frequencies, float)
        key = wanted.tobytes()
        if key not in self._known:
            if len(self._known) >= _REMEMBERED:
                self._known.clear()
            self._known[key] = self._transform(wanted)
        return self._known[key].copy()

    def _transform(self, frequencies: Array) -> Array:
        u, v = frequencies.T
        position = np.arange(_GRID) / (_GRID - 1) - 0.5
        along = np.exp(-2j * np.pi * np.multiply.outer(u, position))
        across = np.exp(-2j * np.pi * np.multiply.outer(v, position))
        # sharing out between neighbours loses sinc^2 of the amplitude, which is given back
        loss = (np.sinc(u / (_GRID - 1)) * np.sinc(v / (_GRID - 1))) ** 2
        columns = np.tensordot(across, self._plane, axes=(1, 0))
        return np.asarray(pack_real(np.einsum("kx,kxc->kc", along, columns) / loss[:, None]), float)

    def mirrored(self, pose: Pose, centers_mm: Array, half_mm: Array, slab: Slab) -> Array:
        """What each block's film mirrors toward the camera, averaged over the block [radiance].

        Args:
            pose: camera_from_probe.
            centers_mm: (blocks, 2); half_mm: (blocks,) half the blocks' sides.
            slab: the glass; its upper face mirrors.

        Returns:
            (blocks, 3) environment's radiance in the mirrored direction times Fresnel's reflectance.
        """
        line = (np.arange(_MIRRORED_PER_SIDE) + 0.5) / _MIRRORED_PER_SIDE * 2.0 - 1.0
        offsets = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        points = centers_mm[:, None] + offsets * half_mm[:, None, None]
        view = pose.view_directions(np.concatenate([points, np.zeros((*points.shape[:2], 1))], axis=-1))
        radiance = self.environment.radiance_at(view * [-1.0, -1.0, 1.0])
        return np.asarray((radiance * slab.interface_reflectance(view[..., 2])[..., None]).mean(axis=1), float)


def _gathered(environment: Environment, slab: Slab) -> Array:
    """Received light, shared out bilinearly to the samples of the light plane's grid."""
    directions, light = environment.samples()
    received = light * (directions[:, 2] * slab.transmittance(directions[:, 2]))[:, None]
    place = (slab.light_plane(directions) + 0.5) * (_GRID - 1)
    cell = np.clip(np.floor(place).astype(np.int64), 0, _GRID - 2)
    part = place - cell
    plane = np.zeros((_GRID * _GRID, received.shape[1]))
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        share = np.abs(1 - dx - part[:, 0]) * np.abs(1 - dy - part[:, 1])
        index = (cell[:, 1] + dy) * _GRID + cell[:, 0] + dx
        for channel in range(plane.shape[1]):
            plane[:, channel] += np.bincount(index, received[:, channel] * share, minlength=len(plane))
    return plane.reshape(_GRID, _GRID, -1)
