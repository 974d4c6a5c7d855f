"""`arlight bench`: speed and accuracy, measured together, beside what one would otherwise use."""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.gate import Failure, judge
from arlight.benchmark.speed.picture import draw_benchmark
from arlight.benchmark.speed.results_file import SHIPPED, load_baseline, results_text
from arlight.benchmark.speed.suite import Suite
from arlight.benchmark.speed.tables import benchmark_tables, failure_table
from arlight.commands.options.bench import BenchOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.errors import ArlightError, OutputError

_SUFFIXES = (".png", ".svg", ".pdf")
_DPI = 150
_TABLE_WIDTH = 125


def run(options: BenchOptions) -> int:
    """Measure, tell, compare; returns the exit status: 1 where something is worse than the baseline allows.

    Raises:
        ArlightError: the baseline cannot be used, an output cannot be written, or there is no headless OpenGL.
    """
    outputs = _prepare(options)
    baseline = None if options.gate is None else load_baseline(options.gate)
    try:
        found, failed = _measure(options, baseline)
    except (ArlightError, KeyboardInterrupt):
        abandon(outputs.values(), worth_keeping=False)
        raise
    console = Console(soft_wrap=True, highlight=False, markup=False)
    # a row is one line, also where the output is a file
    wide = Console(width=max(console.width, _TABLE_WIDTH), highlight=False, markup=False)
    for table in benchmark_tables(found):
        wide.print(table)
    for note in found.notes:
        console.print(note)
    for path in _write(outputs, options, found):
        console.print(f"  {path}")
    if failed:
        wide.print(failure_table(failed))
    elif baseline is not None:
        console.print(f"nothing is worse than {options.gate} allows")
    return 1 if failed else 0


def _prepare(options: BenchOptions) -> dict[str, Output]:
    if options.plot is not None and options.plot.suffix.lower() not in _SUFFIXES:
        raise OutputError(f"{options.plot}: --plot must end in {', '.join(_SUFFIXES)}")
    if not options.length > 0.0:
        raise OutputError(f"--length must be a positive number of seconds, found {options.length:g}")
    inputs = [] if options.gate in (None, SHIPPED) else [Path(str(options.gate))]
    return prepare_outputs({"--json": options.json, "--plot": options.plot}, inputs)


def _measure(options: BenchOptions, baseline: Findings | None) -> tuple[Findings, list[Failure]]:
    with _frames_folder(options.frames) as frames, tempfile.TemporaryDirectory(prefix="arlight-bench-") as scratch:
        suite = Suite(frames, Path(scratch), options.quick, options.length)
        try:
            with _progress(suite.steps) as watch:
                found = suite.run(watch)
                failed = [] if baseline is None else judge(found, baseline, lambda names: suite.again(names, watch))
        finally:
            suite.relighters.release()
    return found, failed


@contextmanager
def _frames_folder(chosen: Path | None) -> Iterator[Path]:
    """Where the clips are filmed to: the chosen folder, made where it is not there, or a temporary one."""
    if chosen is None:
        with tempfile.TemporaryDirectory(prefix="arlight-frames-") as folder:
            yield Path(folder)
        return
    try:
        chosen.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{chosen}: cannot be made ({error.strerror}); choose another --frames") from error
    yield chosen


@contextmanager
def _progress(steps: int) -> Iterator[Callable[[str], None]]:
    """A progress bar on standard error, driven by telling it what begins."""
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("filming", total=steps)
        begun = False

        def watch(name: str) -> None:
            nonlocal begun
            progress.update(task, description=name, advance=int(begun))
            begun = True

        yield watch


def _write(outputs: dict[str, Output], options: BenchOptions, found: Findings) -> list[Path]:
    """Numbers and picture, each in its place.

    Raises:
        OutputError: one cannot be written.
    """
    try:
        if "--json" in outputs:
            outputs["--json"].growing.write_text(results_text(found, options.quick), encoding="utf-8")
        if "--plot" in outputs:
            draw_benchmark(found).savefig(outputs["--plot"].growing, dpi=_DPI)
    except OSError as error:
        abandon(outputs.values(), worth_keeping=False)
        raise OutputError(f"{error.filename}: cannot be written ({error.strerror}); choose another file") from error
    return [output.keep() for output in outputs.values()]
