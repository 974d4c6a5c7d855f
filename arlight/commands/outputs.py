"""Outputs that never destroy what was there before without something better to put in its place.

A new output is written under its own name, so that it can be watched, and read after a crash. Where a file of that
name exists, the new one grows beside it as NAME.partial.EXT and takes its place when the run ends.
"""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from arlight.errors import OutputError


@dataclass(frozen=True, slots=True)
class Output:
    """One file that a command writes."""

    path: Path
    """Where it ends."""
    growing: Path
    """Where it is written meanwhile: `path` itself where nothing was there."""

    def keep(self) -> Path:
        """Put what was written in its place; returns the place.

        Raises:
            OutputError: the old file cannot be replaced; the new one is left beside it.
        """
        try:
            if self.growing != self.path:
                self.growing.replace(self.path)
            return self.path
        except OSError as error:
            raise OutputError(
                f"{self.path}: cannot be replaced ({error.strerror}); the result is in {self.growing}"
            ) from error

    def discard(self) -> None:
        """Remove what was written; what stood there before the run stays."""
        self.growing.unlink(missing_ok=True)


def prepare_outputs(outputs: dict[str, Path | None], inputs: Sequence[Path | None]) -> dict[str, Output]:
    """Check, before any work, that every output can be written and destroys no input.

    Args:
        outputs: path by the name of its option; None where it was not asked for.
        inputs: every file that the command reads; None where it reads none.

    Returns:
        The outputs that were asked for, by the name of their option.

    Raises:
        OutputError: an output is an input or another output, or cannot be written.
    """
    read = [path for path in inputs if path is not None]
    prepared: dict[str, Output] = {}
    for option, path in outputs.items():
        if path is None:
            continue
        output = Output(path, partial_path(path) if path.exists() else path)
        for source in read:
            if _same(path, source) or _same(output.growing, source):
                raise OutputError(f"{source}: {option} would overwrite this input; give {option} another name")
        for other, earlier in prepared.items():
            if _same(path, earlier.path) or _same(output.growing, earlier.growing):
                raise OutputError(f"{path}: {other} and {option} name the same file; give them different names")
        _check_writable(option, path)
        prepared[option] = output
    return prepared


def partial_path(path: Path) -> Path:
    """NAME.partial.EXT beside NAME.EXT."""
    return path.with_name(f"{path.stem}.partial{path.suffix}")


def _same(first: Path, second: Path) -> bool:
    try:
        return first.samefile(second)
    except OSError:
        return first.resolve() == second.resolve()


def _check_writable(option: str, path: Path) -> None:
    if path.is_dir():
        raise OutputError(f"{path}: {option} is a folder; name a file in it")
    folder = path.parent
    if not folder.is_dir():
        raise OutputError(f"{folder}: no such folder; create it, or choose another {option}")
    if path.exists() and not path.is_file():
        raise OutputError(f"{path}: not a regular file; choose another {option}")
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(f"{path}: is write-protected; choose another {option} or change its permissions")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{folder}: no permission to write in this folder; choose another {option}")


def abandon(outputs: Iterable[Output], worth_keeping: bool) -> None:
    """End without replacing anything: what was written is removed, or left where it grew and named on standard error.

    Args:
        outputs: what the command was writing.
        worth_keeping: whether there is anything in it.
    """
    for output in outputs:
        if not worth_keeping:
            output.discard()
        elif output.growing.exists():
            Console(stderr=True, soft_wrap=True, highlight=False, markup=False).print(
                f"{output.growing}: holds what was done so far"
            )
