"""One view of the sheet, and what an assembled sheet would show in it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.estimation.response import BlockResponse
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import BlockLayout, field_blocks
from arlight.tracking.block_means import HARMONICS, BlockMeans

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SheetView:
    """Measurements of the blocks in one frame, and how they were made."""

    means: BlockMeans
    """What was measured."""
    assembly: Assembly
    """Where the film's stripes were taken to lie, and how thick the glass, when it was measured."""
    pose: Pose
    """camera_from_probe of the frame."""
    radius_squared: Array
    """(blocks,) squared distance of each block from the principal point, relative to the picture's half diagonal."""
    blur_px: float
    """Standard deviation of the picture's blur at the fiducials [px]."""
    light: int = 0
    """Which of several lights shone."""

    @classmethod
    def of(
        cls, means: BlockMeans, assembly: Assembly, probe: Probe, camera: Camera, pose: Pose, blur_px: float,
        light: int = 0,
    ) -> "SheetView":  # fmt: skip
        """A view, with where its blocks lie in the picture."""
        centers = np.array([[*block.center_mm, 0.0] for block in field_blocks(probe)])
        away = camera.project(pose, centers) - camera.camera_matrix[:2, 2]
        half_diagonal = 0.5 * np.hypot(*camera.image_size)
        return cls(means, assembly, pose, np.sum(away**2, axis=1) / half_diagonal**2, blur_px, light)


class PredictedSheet:
    """What the blocks of an assembled sheet show; prepared once for all views."""

    def __init__(self, probe: Probe, assembly: Assembly, *, echoes: bool = True) -> None:
        self._probe = probe
        self._layout = BlockLayout.of_probe(probe, assembly)
        self._slab = assembly.slab(probe)
        self.response = BlockResponse(probe, assembly, echoes=echoes)

    def rows(self, view: SheetView, shape: Array | None = None) -> tuple[Array, Array]:
        """Rows (blocks, 7, c) of unit coefficients and (blocks, 7) of the lower face's mirror reflection, before blur.

        They are in the film phase that the view was measured with; `shape` as for `BlockResponse.light`.
        """
        measured = BlockLayout.of_probe(self._probe, view.assembly)
        lead = self._phase(self._layout) - self._phase(measured)
        turned = self._view_phase(self._layout, self._slab.glass_mm, view.pose) - self._view_phase(
            measured, view.assembly.slab(self._probe).glass_mm, view.pose
        )
        means = replace(view.means, view_phasor=view.means.view_phasor * np.exp(-1j * turned))
        return _advanced(self.response.light(means, shape), lead), _advanced(
            self.response.lower_mirror(means)[..., None], lead
        )[..., 0]

    def _phase(self, layout: BlockLayout) -> Array:
        along = np.sum(layout.cycles_per_mm * layout.centers_mm, axis=1)
        return np.asarray(2.0 * np.pi * along + layout.phase_rad, float)

    def _view_phase(self, layout: BlockLayout, glass_mm: float, pose: Pose) -> Array:
        """b = 2 pi f.D toward the camera from the middle of each block."""
        toward = pose.camera_centre_mm - np.column_stack([layout.centers_mm, np.zeros(len(layout.centers_mm))])
        toward /= np.linalg.norm(toward, axis=1, keepdims=True)
        offset = self._slab.offset_mm(toward) * (glass_mm / self._slab.glass_mm)
        return np.asarray(2.0 * np.pi * np.sum(layout.cycles_per_mm * offset, axis=1), float)


def _advanced(rows: Array, lead: Array) -> Array:
    """Rows (blocks, 7, c) in a phase that lags the rows' own by `lead` (blocks,) [rad]."""
    turned = rows.copy()
    for m in range(1, HARMONICS + 1):
        cosine, sine = np.cos(m * lead)[:, None], np.sin(m * lead)[:, None]
        first, second = rows[:, 2 * m - 1], rows[:, 2 * m]
        turned[:, 2 * m - 1] = cosine * first + sine * second
        turned[:, 2 * m] = cosine * second - sine * first
    return turned
