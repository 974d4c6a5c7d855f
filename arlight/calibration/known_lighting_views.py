"""Frames under known light, measured: what calibration sees of them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting_light import KnownLight
from arlight.camera import Camera, Pose
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import BlockLayout
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter
from arlight.video.frame import Frame

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LitFrame:
    """A picture of the sheet under known light."""

    source: str
    """File it is from."""
    frame: Frame
    """The picture."""
    pose: Pose
    """camera_from_probe."""
    blur_px: float
    """Standard deviation of the picture's blur as tracking found it [px]."""
    lighting: int
    """Number of the light that it was taken under."""


@dataclass(frozen=True, slots=True, eq=False)
class LitView:
    """Measurements of a frame, and the geometry to predict them for other assemblies than they were measured with."""

    means: BlockMeans
    """The measurements; harmonics in the phase that the film's stripes have in the assembly measured with."""
    lighting: int
    """Number of the light."""
    blur_px: float
    """Standard deviation of the picture's blur as tracking found it [px]."""
    toward: Array
    """(blocks, 2) where a ray toward the viewer leaves the glass, per thickness: D(v) / h."""
    film_phase: Array
    """(blocks,) phase of the measured-with film's stripes in the block's middle [rad]."""
    view_phase: Array
    """(blocks,) b = 2 pi c.D(v) of the measured-with assembly in the block's middle [rad]."""
    mirrored: Array
    """(blocks, 3) what the film's upper face mirrors of the known environment [radiance]."""

    def in_phase(self, film_phase: Array, view_phase: Array) -> "LitView":
        """The same measurements, told in the phases (blocks,) of another assembly."""
        turn = self.film_phase - film_phase
        phasor = self.means.view_phasor * np.exp(-1j * (view_phase - self.view_phase))
        means = replace(self.means, values=turned_rows(self.means.values, turn), view_phasor=phasor)
        return replace(self, means=means, film_phase=film_phase, view_phase=view_phase)


@dataclass(frozen=True, slots=True)
class SheetGeometry:
    """Stripes and glass of an assembly, as phases in the middle of every block."""

    centers_mm: Array
    """(blocks, 2) centres [mm]."""
    cycles_per_mm: Array
    """(blocks, 2) frequency of the film's stripes [1/mm]."""
    film_phase: Array
    """(blocks,) phase of the film's stripes [rad]."""
    glass_mm: float
    """Thickness of the glass [mm]."""

    @classmethod
    def of(cls, probe: Probe, assembly: Assembly) -> "SheetGeometry":
        """Geometry of a sheet."""
        layout = BlockLayout.of_probe(probe, assembly)
        phase = 2.0 * np.pi * np.sum(layout.cycles_per_mm * layout.centers_mm, axis=1) + layout.phase_rad
        return cls(layout.centers_mm, layout.cycles_per_mm, phase, assembly.slab(probe).glass_mm)

    def view_phase(self, toward: Array) -> Array:
        """(blocks,) b of views that leave the glass at `toward` (blocks, 2), per thickness [rad]."""
        return np.asarray(2.0 * np.pi * self.glass_mm * np.sum(self.cycles_per_mm * toward, axis=1), float)


def measure(
    frames: list[LitFrame],
    lights: list[KnownLight],
    probe: Probe,
    camera: Camera,
    assembly: Assembly,
    stripes: list[Array] | None = None,
) -> list[LitView]:
    """Measure frames.

    Args:
        frames: pictures with pose and number of their light.
        lights: the lights.
        camera: intrinsics that all frames share.
        assembly: where film and glass are believed to be.
        stripes: (blocks, 7, 3) of each frame as it is predicted, to guide subsampled chroma.
    """
    meter = BlockMeter(probe, camera, assembly=assembly)
    geometry = SheetGeometry.of(probe, assembly)
    half = BlockLayout.of_probe(probe).half_mm
    slab = assembly.slab(probe)
    views = []
    for index, frame in enumerate(frames):
        guide = None if stripes is None else stripes[index]
        means = meter.measure(frame.frame, frame.pose, frame.blur_px, guide)
        centers = np.concatenate([geometry.centers_mm, np.zeros((len(half), 1))], axis=1)
        toward = slab.offset_mm(frame.pose.view_directions(centers)) / slab.glass_mm
        mirrored = lights[frame.lighting].mirrored(frame.pose, geometry.centers_mm, half, slab)
        views.append(
            LitView(
                means, frame.lighting, frame.blur_px, toward, geometry.film_phase, geometry.view_phase(toward), mirrored
            )
        )
    return views


def turned_rows(rows: Array, turn: Array) -> Array:
    """Rows (blocks, 7, ...) of stripes whose phase is less by `turn` (blocks,) than what they are told in [rad].

    A stripe exp(i m phi) with phi = psi + turn has the harmonic exp(i m turn) in psi.
    """
    out = rows.copy()
    shape = (-1,) + (1,) * (rows.ndim - 2)
    for m in range(1, rows.shape[1] // 2 + 1):
        cosine, sine = (wave(m * turn).reshape(shape) for wave in (np.cos, np.sin))
        even, odd = rows[:, 2 * m - 1], rows[:, 2 * m]
        out[:, 2 * m - 1] = even * cosine + odd * sine
        out[:, 2 * m] = odd * cosine - even * sine
    return out
