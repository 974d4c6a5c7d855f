"""The paper's calibration at one viewpoint, and how far from it the result still holds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.checks import check_lights, condition_number, order_errors
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.layers.view_measurement import SeenSheet
from arlight.camera import Camera
from arlight.errors import CalibrationError
from arlight.estimation.fixed_estimator import FixedCalibration, FixedEstimator, fixed_calibration
from arlight.fourier import unpack_real
from arlight.probe.design import Probe
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter

Array = NDArray[np.float64]

ONE_VIEW_DEG = 1.0
"""Frames seen from directions that differ by less are from one viewpoint; at order 5 a degree turns b by 20 degrees."""
OFFSETS_DEG = (0.0, 2.0, 5.0, 10.0, 20.0)
"""Offsets of the table; a frame belongs to the nearest."""


@dataclass(frozen=True, slots=True)
class OffsetErrors:
    """Errors of frames that are seen from about one angle beside the calibration's viewpoint."""

    offset_deg: float
    """The angle [deg]."""
    orders: Array
    """(order + 1,) median over the frames of each order's error, relative to |L~_0|."""
    frames: int
    """How many frames."""


@dataclass(frozen=True, slots=True)
class FixedResult:
    """The paper's calibration."""

    calibration: FixedCalibration
    """M, as V and L."""
    condition: float
    """Condition number of the lights' coefficients."""
    offsets: tuple[OffsetErrors, ...]
    """Where it breaks: errors by the angle beside its viewpoint, every lighting by the matrix of the others."""


def calibrate_fixed(
    seen: Sequence[SeenSheet], lights: Sequence[KnownLight], probe: Probe, camera: Camera
) -> FixedResult:
    """Solve L = M V from frames of one viewpoint; frames from elsewhere only show where it breaks.

    Args:
        seen: frames with the number of their light; the viewpoint is the one that the most lightings share.
        lights: the lights by that number.
        probe: the sheet; the paper's procedure takes it as designed.
        camera: the camera of all frames.

    Raises:
        CalibrationError: too few lightings, lights all alike, or no viewpoint that all lightings share.
    """
    check_lights(lights, seen, probe)
    reference = _common_view(seen, len(lights))
    angles = [angle_deg(frame, reference) for frame in seen]
    meter = BlockMeter(probe, camera)
    means = [_measured(meter, frame) for frame in seen]
    known = [light.packed(probe.frequencies) for light in lights]
    chosen = [number for number, angle in enumerate(angles) if angle < ONE_VIEW_DEG]

    def solve(without: int | None) -> FixedCalibration:
        used = [number for number in chosen if seen[number].light != without]
        numbers = [seen[number].light for number in used]
        return fixed_calibration(probe, [means[i] for i in used], [known[i] for i in numbers], numbers)

    offsets: tuple[OffsetErrors, ...] = ()
    if len(lights) > 2:
        estimators = [FixedEstimator(probe, solve(without)) for without in range(len(lights))]
        errors = [
            order_errors(
                estimators[frame.light].estimate(measured, 0.0).lighting.coefficients,
                unpack_real(known[frame.light]),
                probe.frequencies,
            )
            for frame, measured in zip(seen, means, strict=True)
        ]
        offsets = by_offset(angles, errors)
    return FixedResult(solve(None), condition_number(lights, probe)[0], offsets)


def by_offset(angles_deg: Sequence[float], errors: Sequence[Array]) -> tuple[OffsetErrors, ...]:
    """Median errors (order + 1,) of frames by their angle beside a viewpoint, those beyond the last offset left out."""
    limits = np.append((np.array(OFFSETS_DEG[1:]) + OFFSETS_DEG[:-1]) / 2.0, 1.25 * OFFSETS_DEG[-1])
    place = np.searchsorted(limits, angles_deg)
    table = []
    for number, offset in enumerate(OFFSETS_DEG):
        own = [error for error, at in zip(errors, place, strict=True) if at == number]
        if own:
            table.append(OffsetErrors(offset, np.median(own, axis=0), len(own)))
    return tuple(table)


def angle_deg(frame: SeenSheet, other: SeenSheet) -> float:
    """Angle between the directions from which the sheet is seen in two frames [deg]."""
    first, second = (view.offset_mm / np.linalg.norm(view.offset_mm) for view in (frame, other))
    return float(np.rad2deg(np.arccos(np.clip(first @ second, -1.0, 1.0))))


def _common_view(seen: Sequence[SeenSheet], lightings: int) -> SeenSheet:
    """A frame near whose viewpoint there are frames under every lighting."""

    def shared(frame: SeenSheet) -> int:
        return len({other.light for other in seen if angle_deg(other, frame) < ONE_VIEW_DEG})

    best = max(seen, key=shared)
    if shared(best) < lightings:
        raise CalibrationError(
            f"L = MV holds for one viewpoint, and none is shared by more than {shared(best)} of the {lightings} "
            f"lightings (within {ONE_VIEW_DEG:g} degree); leave camera and sheet where they are while the light "
            "changes, or calibrate with --estimator layers, which takes frames from all sides"
        )
    return best


def _measured(meter: BlockMeter, frame: SeenSheet) -> BlockMeans:
    pose = frame.pose.camera_from_probe
    assert pose is not None
    return meter.measure(frame.frame, pose, frame.pose.blur_px)
