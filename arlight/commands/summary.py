"""The closing summary of a run."""

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.table import Table

from arlight.results.statistics import RunStatistics

_NEARLY_ALL = 0.95


def print_summary(
    statistics: RunStatistics, written: Mapping[str, Path], interrupted: bool, deadline: str | None = None
) -> None:
    """Print what a run amounts to and where its results are.

    Args:
        statistics: of the loop.
        written: files by what they hold.
        interrupted: whether Ctrl-C ended the run.
        deadline: how well a deadline was held; None where there was none.
    """
    table = Table(show_header=False, box=None, pad_edge=False)
    state = " (interrupted)" if interrupted else ""
    table.add_row("frames", f"{statistics.frames}{state}")
    counts = ", ".join(f"{count} {status}" for status, count in sorted(statistics.statuses.items(), reverse=True))
    table.add_row("sheet", f"{100.0 * statistics.tracked_share:.1f} % tracked ({counts})")
    table.add_row("speed", _speed(statistics))
    if deadline is not None:
        table.add_row("deadline", deadline)
    stages = ", ".join(f"{stage} {ms:.1f}" for stage, ms in statistics.median_ms.items())
    table.add_row("ms per frame", f"{stages} (medians)")
    for what, path in written.items():
        table.add_row(what, str(path))
    Console(soft_wrap=True, highlight=False, markup=False).print(table)


def _speed(statistics: RunStatistics) -> str:
    """Frames per second, and how long a frame took at most in half of the cases and nearly always."""
    text = f"{statistics.frames_per_second:.1f} frames/s"
    if statistics.frames > 1:
        half, most = statistics.wall_quantile_ms(0.5), statistics.wall_quantile_ms(_NEARLY_ALL)
        text += f", a frame every {half:.1f} ms, {100.0 * _NEARLY_ALL:.0f} % within {most:.1f} ms"
    return text
