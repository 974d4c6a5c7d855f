"""One view of the sheet, and what an assembled sheet would show in it."""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.estimation.response import BlockResponse
from arlight.estimation.stripe_rows import turned_rows
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import BlockLayout
from arlight.tracking.block_means import BlockMeans

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SheetView:
    """Measurements of the blocks in one frame, and how they were made."""

    means: BlockMeans
    """What was measured."""
    film_phase_rad: Array
    """(blocks,) phase of the film's stripes in each block's middle, as it was taken to be in measuring [rad]."""
    view_phase_rad: Array
    """(blocks,) b = 2 pi f.D toward the camera from there, for the glass as it was taken to be [rad]."""
    offset_per_mm: Array
    """(blocks, 2) D toward the camera from there, relative to the glass's thickness."""
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
        """A view.

        Args:
            means: measurements of the blocks of the probe's field.
            assembly: where the film's stripes were taken to lie, and how thick the glass, when it was measured.
            probe: the sheet as designed.
            camera, pose: of the frame; camera_from_probe.
            blur_px: standard deviation of the picture's blur [px].
            light: which of several lights shone.
        """
        layout, slab = BlockLayout.of_probe(probe, assembly), assembly.slab(probe)
        centers = np.column_stack([layout.centers_mm, np.zeros(len(layout.centers_mm))])
        offset = slab.offset_mm(pose.view_directions(centers)) / slab.glass_mm
        view_phase = _view_phase(layout, slab.glass_mm, offset)
        away = camera.project(pose, centers) - camera.camera_matrix[:2, 2]
        half_diagonal = 0.5 * np.hypot(*camera.image_size)
        radius_squared = np.sum(away**2, axis=1) / half_diagonal**2
        return cls(means, _film_phase(layout), view_phase, offset, radius_squared, blur_px, light)

    def of_blocks(self, chosen: NDArray[np.bool_]) -> "SheetView":
        """The same view of some blocks (blocks,) alone."""
        means = BlockMeans(**{part.name: getattr(self.means, part.name)[chosen] for part in fields(BlockMeans)})
        return replace(
            self,
            means=means,
            film_phase_rad=self.film_phase_rad[chosen],
            view_phase_rad=self.view_phase_rad[chosen],
            offset_per_mm=self.offset_per_mm[chosen],
            radius_squared=self.radius_squared[chosen],
        )


class PredictedSheet:
    """What the blocks of an assembled sheet show; prepared once for all views."""

    def __init__(self, probe: Probe, assembly: Assembly, *, echoes: bool = True) -> None:
        """Solve the stack; `echoes` as in `BlockResponse`."""
        self._layout = BlockLayout.of_probe(probe, assembly)
        self._film_phase = _film_phase(self._layout)
        self._glass_mm = assembly.slab(probe).glass_mm
        self.response = BlockResponse(probe, assembly, echoes=echoes)
        """The blocks' response in the phase of this sheet's own film."""

    def light(self, view: SheetView, shape: Array | None = None) -> Array:
        """Rows (blocks, 7, c) of unit coefficients, before blur, in the film phase that the view was measured with.

        Args:
            view: from where the sheet is seen; the measured values are not read.
            shape: as for `BlockResponse.light`.
        """
        return turned_rows(self.response.light(self._seen(view), shape), self._lead(view))

    def lower_mirror(self, view: SheetView) -> Array:
        """Rows (blocks, 7) of the mirror reflection in the lower face where the upper face's is 1; as `light`."""
        return turned_rows(self.response.lower_mirror(self._seen(view)), self._lead(view))

    def _lead(self, view: SheetView) -> Array:
        """(blocks,) how far the film's stripes lie ahead of where they were taken to be [rad]."""
        return self._film_phase - view.film_phase_rad

    def _seen(self, view: SheetView) -> BlockMeans:
        """From where the blocks are seen through this glass."""
        turn = _view_phase(self._layout, self._glass_mm, view.offset_per_mm) - view.view_phase_rad
        return replace(view.means, view_phasor=view.means.view_phasor * np.exp(-1j * turn))


def _film_phase(layout: BlockLayout) -> Array:
    along = np.sum(layout.cycles_per_mm * layout.centers_mm, axis=1)
    return np.asarray(2.0 * np.pi * along + layout.phase_rad, float)


def _view_phase(layout: BlockLayout, glass_mm: float, offset_per_mm: Array) -> Array:
    return np.asarray(2.0 * np.pi * glass_mm * np.sum(layout.cycles_per_mm * offset_per_mm, axis=1), float)
