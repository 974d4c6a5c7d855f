"""`arlight calibrate`: one subcommand for each thing that can be calibrated."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from arlight.commands import calibrate_camera, calibrate_known, calibrate_printer, calibrate_self

What = (
    Annotated[calibrate_self.CalibrateSelfOptions, tyro.conf.subcommand("self")]
    | Annotated[calibrate_known.CalibrateKnownOptions, tyro.conf.subcommand("known")]
    | Annotated[calibrate_camera.CalibrateCameraOptions, tyro.conf.subcommand("camera")]
    | Annotated[calibrate_printer.CalibratePrinterOptions, tyro.conf.subcommand("printer")]
)

_RUN: dict[type, Callable[[Any], int]] = {
    calibrate_self.CalibrateSelfOptions: calibrate_self.run,
    calibrate_known.CalibrateKnownOptions: calibrate_known.run,
    calibrate_camera.CalibrateCameraOptions: calibrate_camera.run,
    calibrate_printer.CalibratePrinterOptions: calibrate_printer.run,
}


@dataclass(frozen=True)
class CalibrateOptions:
    """Fit the model to the sheet, the camera and the printer that are there."""

    what: tyro.conf.OmitArgPrefixes[tyro.conf.OmitSubcommandPrefixes[What]]
    """What to calibrate."""


def run(options: CalibrateOptions) -> int:
    """Run the chosen calibration; returns the exit status.

    Raises:
        ArlightError: something the user can mend.
    """
    return _RUN[type(options.what)](options.what)
