"""`arlight calibrate`: one subcommand for each thing that can be calibrated."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from arlight.commands import calibrate_self

What = Annotated[calibrate_self.CalibrateSelfOptions, tyro.conf.subcommand("self")]

_RUN: dict[type, Callable[[Any], int]] = {calibrate_self.CalibrateSelfOptions: calibrate_self.run}


@dataclass(frozen=True)
class CalibrateOptions:
    """Fit the model to the sheet, the camera and the printer that are there."""

    what: tyro.conf.OmitSubcommandPrefixes[What]
    """What to calibrate."""


def run(options: CalibrateOptions) -> int:
    """Run the chosen calibration; returns the exit status."""
    return _RUN[type(options.what)](options.what)
