"""`arlight calibrate`: one subcommand for each thing that can be calibrated."""

from arlight.commands.dispatch import run_command
from arlight.commands.options.calibrate import CalibrateOptions


def run(options: CalibrateOptions) -> int:
    """Run the chosen calibration; returns the exit status.

    Raises:
        ArlightError: something the user can mend.
    """
    return run_command(options.what)
