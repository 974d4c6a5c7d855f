"""How the sheet of a clip turned out: from a calibration file, from the clip itself, or as designed."""

from dataclasses import dataclass
from pathlib import Path

from arlight.camera import Camera
from arlight.commands.options.footage import CalibrationOptions
from arlight.errors import CalibrationError
from arlight.estimation.fixed_estimator import FixedCalibration, FixedEstimator
from arlight.probe.assembly import Assembly
from arlight.probe.assembly_storage import load_assembly, load_vignetting
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.video.sidecars import find_sidecar


@dataclass(frozen=True, slots=True)
class SheetCalibration:
    """The sheet as it is."""

    assembly: Assembly | None = None
    """How it was printed and put together; None for exactly as designed."""
    vignetting: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Radial gain of the lens that was found beside the camera's own."""
    fixed: FixedEstimator | None = None
    """The paper's L = MV in place of the model's estimate."""
    path: Path | None = None
    """Where it was read from."""
    note: str | None = None
    """What the user should know of it."""


def calibration_of(clip: Path, options: CalibrationOptions, probe: Probe, camera: Camera) -> SheetCalibration:
    """The calibration that was given or asked for, or the one that lies beside the clip.

    Raises:
        ProbeError: the calibration cannot be used, or is another sheet's.
        CalibrationError: the options contradict each other, the clip does not allow self-calibration, or the matrix
            is another sheet's.
    """
    given = options.calibration
    if options.self_calibrate and given is not None:
        raise CalibrationError(
            f"{given}: --self-calibrate makes a calibration of its own; leave it or --calibration out"
        )
    if options.estimator == "fixed":
        return _fixed(options, probe)
    if options.self_calibrate:
        # here, because it takes long to load what only few runs need
        from arlight.commands.self_calibration import self_calibrate_clip

        found = self_calibrate_clip(clip, probe, camera)
        note = f"{clip}: sheet calibrated on {found.views} views (residual chi-square {found.chi2:.2f})"
        return SheetCalibration(found.assembly, found.vignetting, note=note)
    path = given or find_sidecar(clip, "calibration")
    if path is None:
        return SheetCalibration()
    assembly = load_assembly(path, len(field_blocks(probe)))
    return SheetCalibration(assembly, load_vignetting(path), path=path, note=f"{clip}: sheet as in {path}")


def _fixed(options: CalibrationOptions, probe: Probe) -> SheetCalibration:
    if options.self_calibrate:
        raise CalibrationError("--estimator fixed needs known lighting; leave it or --self-calibrate out")
    path = options.calibration
    if path is None:
        raise CalibrationError(
            "--estimator fixed needs the NAME.fixed.npz that `arlight calibrate known --estimator fixed` wrote: "
            "--calibration FILE"
        )
    return SheetCalibration(fixed=FixedEstimator(probe, FixedCalibration.load(path, probe)), path=path)
