"""The values of a lighting log: what its frames have in common, and one frame."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.fourier import orders_up_to
from arlight.lighting_tracker import FrameEstimate
from arlight.optics import Slab
from arlight.probe.design import Probe


@dataclass(frozen=True, slots=True)
class LogHeader:
    """What every line of a log has in common."""

    frequencies: NDArray[np.int64]
    """(k, 2) frequencies (u, v) in the order of the coefficients."""
    camera: Camera
    """The camera that filmed the sheet."""
    slab: Slab
    """The glass of the sheet, which ties the light plane to directions."""
    sheet_mm: tuple[float, float]
    """Width and height of the sheet [mm]."""
    source: str
    """The clip that was read, as it was named."""
    probe: str
    """The probe file, as it was named."""

    @classmethod
    def of(cls, probe: Probe, camera: Camera, source: str, probe_path: str, order: int | None = None) -> "LogHeader":
        """The header for footage of a probe, with the light up to an order; the sheet's by default."""
        frequencies = probe.frequencies if order is None else probe.frequencies[orders_up_to(probe.frequencies, order)]
        return cls(frequencies, camera, probe.slab, probe.sheet_mm, source, probe_path)


@dataclass(frozen=True, slots=True)
class LogRecord:
    """One frame of a log."""

    frame: int
    """Index of the frame, from 0."""
    time_s: float
    """Presentation time of the frame [s]."""
    status: str
    """`tracked`, `coasting` or `lost`."""
    pose: Pose | None
    """camera_from_probe [mm]; None while lost."""
    reprojection_rms_px: float
    """Residual of the markers [px]; nan where no marker was used."""
    coefficients: NDArray[np.complex128] | None
    """(k, 3) coefficients [radiance * sr]; None before the first estimate."""
    stddev: NDArray[np.float64] | None
    """(k, 3) their standard deviation; None before the first estimate."""
    order: int | None
    """Highest order in use; None before the first estimate."""
    chi2: float
    """Residual chi-square per degree of freedom; nan where no block was seen."""
    timings_ms: dict[str, float]
    """Milliseconds per stage."""
    unexplained: float = math.nan
    """Share of the stripes that the probe does not explain under any light; nan where none are resolved."""
    wall_ms: float = math.nan
    """Milliseconds from the end of the frame before to the end of this one; stages overlap, so that it is less than
    their sum; nan for the first frame."""

    @classmethod
    def of(cls, estimate: FrameEstimate, timings_s: dict[str, float], wall_s: float = math.nan) -> "LogRecord":
        """The record of a frame's estimate, with the time that each stage took, and that since the last frame [s]."""
        lighting, pose = estimate.lighting, estimate.pose
        return cls(
            frame=estimate.index,
            time_s=estimate.time_s,
            status=pose.status,
            pose=pose.camera_from_probe,
            reprojection_rms_px=pose.reprojection_rms_px,
            coefficients=None if lighting is None else lighting.coefficients,
            stddev=None if lighting is None else lighting.stddev,
            order=None if lighting is None else lighting.order,
            chi2=math.nan if lighting is None else lighting.chi2,
            timings_ms={stage: 1000.0 * seconds for stage, seconds in timings_s.items()},
            unexplained=estimate.unexplained,
            wall_ms=1000.0 * wall_s,
        )
