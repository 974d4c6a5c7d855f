"""`arlight table`: the error per order over camera tilts and sheet widths."""

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from arlight.benchmark.accuracy import AccuracyCell, AccuracySettings, accuracy_table
from arlight.commands.options.table import TableOptions
from arlight.probe.layout import design_probe
from arlight.synthetic.captured import load_environment
from arlight.synthetic.settings import SynthesisSettings

_FIXED_WIDTH = 45
_CELL_WIDTH = 26


def run(options: TableOptions) -> int:
    """Print the table; returns the exit status.

    Raises:
        ArlightError: the environment or the sheet cannot be used, or there is no headless OpenGL.
    """
    settings = AccuracySettings(
        tilts_deg=options.tilts_deg,
        widths_px=options.widths_px,
        frames=options.frames,
        footage=SynthesisSettings(environment=options.environment, path="still"),
    )
    # refused before the sheet is drawn, which takes seconds
    load_environment(options.environment)
    probe = design_probe(options.order)
    console = Console(soft_wrap=True, highlight=False, markup=False)
    cells = []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("clips", total=len(options.tilts_deg) * len(options.widths_px))
        for cell in accuracy_table(settings, probe):
            cells.append(cell)
            progress.advance(task)
    # a row is one line, also where the output is a file
    console.print(_table(cells, options), width=max(console.width, _FIXED_WIDTH + _CELL_WIDTH * (options.order + 1)))
    return 0


def _table(cells: list[AccuracyCell], options: TableOptions) -> Table:
    table = Table(
        title=f"order {options.order} sheet, {options.environment}: error / |L_0| in %: filtered / one frame / bound"
    )
    for name in ("tilt", "width", "tracked", "pose px"):
        table.add_column(name, justify="right")
    for order in range(options.order + 1):
        table.add_column(str(order), justify="right")
    for cell in cells:
        pose = cell.filtered.pose
        errors = [
            f"{100.0 * filtered.relative_to_l0:.2f} / {100.0 * single.relative_to_l0:.2f} / {100.0 * bound:.2f}"
            for filtered, single, bound in zip(cell.filtered.orders, cell.single_frame.orders, cell.bound, strict=True)
        ]
        table.add_row(
            f"{cell.tilt_deg:g}",
            f"{cell.width_px:g}",
            f"{100.0 * cell.filtered.tracked_share:.0f} %",
            "-" if pose is None else f"{pose.rms_px:.3f}",
            *errors,
        )
    return table
