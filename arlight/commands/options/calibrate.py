"""What `arlight calibrate` takes: the name of what to calibrate, and what that takes."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from arlight.commands.options.calibrate_camera import CalibrateCameraOptions
from arlight.commands.options.calibrate_known import CalibrateKnownOptions
from arlight.commands.options.calibrate_printer import CalibratePrinterOptions
from arlight.commands.options.calibrate_self import CalibrateSelfOptions

What = (
    Annotated[CalibrateSelfOptions, tyro.conf.subcommand("self")]
    | Annotated[CalibrateKnownOptions, tyro.conf.subcommand("known")]
    | Annotated[CalibrateCameraOptions, tyro.conf.subcommand("camera")]
    | Annotated[CalibratePrinterOptions, tyro.conf.subcommand("printer")]
)


@dataclass(frozen=True)
class CalibrateOptions:
    """Fit the model to the sheet, the camera and the printer that are there."""

    what: tyro.conf.OmitArgPrefixes[tyro.conf.OmitSubcommandPrefixes[What]]
    """What to calibrate."""
