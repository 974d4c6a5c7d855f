"""Fresh processes of the command: how soon they have a result, and how much memory they need."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from arlight.errors import ArlightError

_POLL_S = 0.002
_PATIENCE_S = 120.0


_LAUNCHER = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, usage = os.wait4(process.pid, 0)
print(usage.ru_maxrss, usage.ru_utime + usage.ru_stime)
sys.exit(os.waitstatus_to_exitcode(status) & 255)
"""


class CommandFailedError(ArlightError):
    """The command failed in a process of its own."""


@dataclass(frozen=True, slots=True)
class Finished:
    """What a process needed."""

    wall_s: float
    """From its start to its end [s]."""
    cpu_s: float
    """CPU time of it and its threads [s]."""
    peak_memory_mb: float
    """Most memory that was resident [MB]."""


def arlight_command(arguments: Sequence[str | Path]) -> list[str]:
    """The command line of this very package."""
    return [sys.executable, "-m", "arlight", *map(str, arguments)]


def run_to_end(command: Sequence[str], environment: Mapping[str, str] | None = None) -> Finished:
    """Run a command.

    Raises:
        CommandFailedError: it failed; with what it said.
    """
    # a process begins with the peak of the one that forks it: a small one stands between
    launched = [sys.executable, "-c", _LAUNCHER, *command]
    begun = time.perf_counter()
    done = subprocess.run(launched, capture_output=True, env=_environment(environment), check=False)
    wall_s = time.perf_counter() - begun
    if done.returncode:
        said = done.stderr.decode(errors="replace")
        raise CommandFailedError(f"{' '.join(command)}: failed ({done.returncode}): {said}")
    # kilobytes, but bytes on macOS
    unit = 2.0**20 if sys.platform == "darwin" else 2.0**10
    peak, cpu_s = done.stdout.split()[-2:]
    return Finished(wall_s, float(cpu_s), int(peak) / unit)


def time_to_lines(
    command: Sequence[str], file: Path, lines: int, environment: Mapping[str, str] | None = None
) -> float:
    """Wall time from the start of a command to the moment when a file of its has so many lines [s]; then it is ended.

    Raises:
        CommandFailedError: it ended without writing them, or took minutes.
    """
    file.unlink(missing_ok=True)
    begun = time.perf_counter()
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=_environment(environment)
    ) as process:
        try:
            while _lines(file) < lines:
                if process.poll() is not None and _lines(file) < lines:
                    said = process.stderr.read() if process.stderr else b""
                    raise CommandFailedError(f"{' '.join(command)}: ended early: {said.decode(errors='replace')}")
                if time.perf_counter() - begun > _PATIENCE_S:
                    raise CommandFailedError(f"{' '.join(command)}: no result within {_PATIENCE_S:g} s")
                time.sleep(_POLL_S)
            return time.perf_counter() - begun
        finally:
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            process.kill()


def _lines(file: Path) -> int:
    try:
        return file.read_bytes().count(b"\n")
    except FileNotFoundError:
        return 0


def _environment(added: Mapping[str, str] | None) -> dict[str, str]:
    return {**os.environ, **(added or {})}
