"""`arlight calibrate self`: the assembled sheet from a clip of it, without known light."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from arlight.calibration.layers.layer_parameters import NAMES, PARAMETERS
from arlight.calibration.layers.self_calibration import SelfCalibration
from arlight.commands.footage import sheet_and_camera
from arlight.commands.options.calibrate_self import CalibrateSelfOptions
from arlight.commands.outputs import prepare_outputs
from arlight.commands.self_calibration import self_calibrate_clip
from arlight.errors import ArlightError, CalibrationError
from arlight.probe.assembly_storage import save_assembly


def run(options: CalibrateSelfOptions) -> int:
    """Calibrate and write the result; returns the exit status.

    Raises:
        CalibrationError: the views do not tell the sheet from the light.
        ArlightError: clip, probe, camera or output cannot be used.
    """
    if not options.seconds > 0.0:
        raise CalibrationError(f"--seconds must be a time above 0, found {options.seconds:g}")
    probe, camera, notes = sheet_and_camera(options.clip, options.footage)
    path = options.output or Path(f"{options.clip.stem}.calibration.json")
    output = prepare_outputs({"--output": path}, [options.clip])["--output"]
    console = Console(soft_wrap=True, highlight=False, markup=False)
    for note in notes:
        console.print(note)
    try:
        found = self_calibrate_clip(options.clip, probe, camera, options.seconds)
        save_assembly(found.assembly, output.growing, found.stddev, found.vignetting)
    except (ArlightError, KeyboardInterrupt):
        output.discard()
        raise
    console.print(_table(found))
    if found.undetermined:
        console.print(f"not told by these views, kept near what is usual: {', '.join(found.undetermined)}")
    console.print(f"{output.keep()}")
    return 0


def _table(found: SelfCalibration) -> Table:
    table = Table(title=f"the sheet as it is, from {found.views} views (residual chi-square {found.chi2:.2f})")
    for column in ("", "found", "standard deviation", "as designed"):
        table.add_column(column, justify="left" if not column else "right")
    for name, parameter in zip(NAMES, PARAMETERS, strict=True):
        table.add_row(name, f"{found.values[name]:.4f}", f"{found.stddev[name]:.4f}", f"{parameter.expected:g}")
    return table
