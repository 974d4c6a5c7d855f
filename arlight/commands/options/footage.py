"""What was filmed, with what, and how the sheet turned out."""

from dataclasses import dataclass
from typing import Literal

from arlight.commands.options.files import OptionalFile

EstimatorName = Literal["model", "fixed"]


@dataclass(frozen=True)
class SheetAndCamera:
    """What was filmed, and with what; found beside the clip where it is not given."""

    probe: OptionalFile = None
    """probe.json of the sheet that was filmed."""
    camera: OptionalFile = None
    """camera.json of the camera that filmed it; without one the focal length is estimated from the clip."""


@dataclass(frozen=True)
class CalibrationOptions:
    """How the sheet was printed and put together; found beside the clip where it is not given."""

    calibration: OptionalFile = None
    """NAME.calibration.json of the sheet as it was printed and put together, from `arlight calibrate`."""
    self_calibrate: bool = False
    """Calibrate the sheet on the first seconds of the clip itself; the camera must move over it."""
    estimator: EstimatorName = "model"
    """model: for every view; fixed: the paper's L = MV, right for one view alone, with --calibration NAME.fixed.npz
    from `arlight calibrate known --estimator fixed`."""


@dataclass(frozen=True)
class FootageOptions(CalibrationOptions, SheetAndCamera):
    """What was filmed, with what, and how the sheet turned out; found beside the clip where it is not given."""
