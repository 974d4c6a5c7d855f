"""Where the blocks of the field lie in the image, and which of their pixels may be used."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.assembly import Assembly
from arlight.probe.design import Block, Probe
from arlight.tracking.block_means import HARMONICS

Array = NDArray[np.float64]

_RESOLVED_CYCLES = 0.55
"""Harmonics up to this image frequency are fitted; beyond, pixels alias them onto lower ones [1/px]."""
_FIRST_CYCLES = 0.85
"""The first harmonic is fitted up to here, so that what aliases does not leak into the mean [1/px]."""
_EDGE_PX = 1.5
"""Pixels to keep from a block's border for the pixel's own square and the codec, beside the blur."""


def field_blocks(probe: Probe) -> tuple[Block, ...]:
    """The blocks that measure light: all but the wedge."""
    return tuple(block for block in probe.blocks if block.kind != "wedge")


def design_cycles_per_mm(blocks: tuple[Block, ...], period_mm: float) -> Array:
    """(blocks, 2) frequency n / P of each block's stripes as designed, 0 where there are none [1/mm]."""
    frequencies = np.array([block.frequency or (0, 0) for block in blocks], float).reshape(-1, 2)
    return np.asarray(frequencies / period_mm, float)


@dataclass(frozen=True)
class BlockLayout:
    """The blocks' geometry on the sheet, as arrays."""

    centers_mm: Array
    """(blocks, 2) centres in the probe frame [mm]."""
    half_mm: Array
    """(blocks,) half the side [mm]."""
    cycles_per_mm: Array
    """(blocks, 2) frequency of the film's pattern, 0 where there is none [1/mm]."""
    phase_rad: Array
    """(blocks,) phase of the film's pattern at the probe frame's origin [rad]."""

    @classmethod
    def of_probe(cls, probe: Probe, assembly: Assembly | None = None) -> "BlockLayout":
        """The layout of a sheet's field; its patterns lie where the assembled film has them."""
        blocks = field_blocks(probe)
        film = (assembly or Assembly()).film.registration
        cycles = film.cycles_per_mm(design_cycles_per_mm(blocks, probe.slab.period_mm))
        return cls(
            np.array([block.center_mm for block in blocks], float).reshape(-1, 2),
            np.array([block.size_mm / 2.0 for block in blocks]),
            cycles,
            -2.0 * np.pi * cycles @ np.array(film.shift_mm),
        )

    def view(self, camera: Camera, pose: Pose, blur_px: float) -> "BlockView":
        """How the blocks appear from a pose."""
        corners = np.array([[0, 0], [-1, -1], [1, -1], [1, 1], [-1, 1]], float)
        points = self.centers_mm[:, None] + corners * self.half_mm[:, None, None]
        flat = np.concatenate([points.reshape(-1, 2), np.zeros((points.size // 2, 1))], axis=1)
        pixels = camera.project(pose, flat).reshape(points.shape)
        # central differences over the block: (px per mm) matrices, columns for x and y
        right = 0.5 * (pixels[:, 2] + pixels[:, 3] - pixels[:, 1] - pixels[:, 4])
        up = 0.5 * (pixels[:, 3] + pixels[:, 4] - pixels[:, 1] - pixels[:, 2])
        jacobian = np.stack([right, up], axis=-1) / (2.0 * self.half_mm[:, None, None])
        mm_from_px = np.linalg.inv(jacobian)
        cycles_per_px = np.einsum("bij,bi->bj", mm_from_px, self.cycles_per_mm)
        margin = (_EDGE_PX + blur_px) * np.linalg.norm(mm_from_px, axis=2)
        boxes = np.concatenate([np.floor(pixels.min(axis=1)), np.ceil(pixels.max(axis=1))], axis=1)
        limits = np.array([*camera.image_size, *camera.image_size], float)
        return BlockView(
            np.clip(boxes, -1.0, limits).astype(np.int64),
            margin,
            cycles_per_px,
            _harmonics(cycles_per_px),
            camera.gain(pixels[:, 0]),
        )


@dataclass(frozen=True, slots=True)
class BlockView:
    """The blocks as one camera sees them."""

    boxes: NDArray[np.int64]
    """(blocks, 4) bounding boxes x0, y0, x1, y1, inclusive [px]."""
    margin_mm: Array
    """(blocks, 2) distance to keep from the block's border, along x and y [mm]."""
    cycles_per_px: Array
    """(blocks, 2) frequency of the film's pattern in the image [1/px]."""
    harmonics: NDArray[np.int64]
    """(blocks,) how many harmonics the pixels can separate."""
    gain: Array
    """(blocks,) the lens's vignetting in the middle of each block."""


def _harmonics(cycles_per_px: Array) -> NDArray[np.int64]:
    frequency = np.hypot(*cycles_per_px.T)
    resolved = np.floor(_RESOLVED_CYCLES / np.maximum(frequency, 1e-9))
    at_least = (frequency <= _FIRST_CYCLES).astype(float)
    return np.where(frequency > 0.0, np.clip(np.maximum(resolved, at_least), 0, HARMONICS), 0).astype(np.int64)
