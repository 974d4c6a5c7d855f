"""Frames through the pipeline into the outputs, with progress, until they end or Ctrl-C."""

from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from time import perf_counter
from types import TracebackType
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

from arlight.commands.background import InOrder, prefetched
from arlight.commands.interruption import Interruption
from arlight.pipeline import FrameResult, Pipeline
from arlight.results.log import LightingLogWriter
from arlight.results.record import LogRecord
from arlight.results.report import ReportRecorder
from arlight.results.statistics import RunStatistics
from arlight.video.frame import Frame


class FrameSink(Protocol):
    """What takes finished frames."""

    def write(self, frame: Frame) -> None:
        """Take the next frame."""

    def close(self) -> None:
        """Finish the file."""


@dataclass(frozen=True, slots=True)
class Work:
    """What a loop is about."""

    title: str
    """Name in the progress line."""
    frames: int | None
    """Frames to expect; None where that is not known."""
    source: str = "decode"
    """Name of the stage that the frames come from."""


@dataclass(slots=True)
class Sinks:
    """Where results go, each optional; leaving the `with` block closes the files, whatever happened."""

    video: FrameSink | None = None
    """Takes the composites."""
    log: LightingLogWriter | None = None
    """Takes pose and lighting."""
    report: ReportRecorder | None = None
    """Remembers what the report will show."""

    def __enter__(self) -> "Sinks":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # the log first: closing a video can fail on a full disk
        if self.log is not None:
            self.log.close()
        if self.video is not None:
            self.video.close()


def run_frames(
    frames: Iterable[Frame], pipeline: Pipeline, sinks: Sinks, statistics: RunStatistics, work: Work
) -> bool:
    """The loop: decode, process, encode, log; Ctrl-C ends it after the frame in hand.

    Frames come from one thread, are processed in the caller's, and go into the sinks from a third.

    Args:
        frames: in order.
        pipeline: what is done with each.
        sinks: where the results go.
        statistics: counts the frames; up to date after each, whatever ends the loop.
        work: what the progress line shows.

    Returns:
        Whether it was interrupted.
    """

    def finish(processed: tuple[FrameResult, float]) -> None:
        statistics.add(_write(*processed, work.source, sinks))
        progress.advance(statistics)

    with (
        Interruption() as interruption,
        FrameProgress(work) as progress,
        InOrder(finish) as results,
        closing(prefetched(frames)) as source,
    ):
        for frame, source_s in source:
            results.put((pipeline.process(frame), source_s))
            if interruption.requested:
                break
    return interruption.requested


def _write(result: FrameResult, source_s: float, source: str, sinks: Sinks) -> LogRecord:
    timings = {source: source_s, **result.timings_s}
    if sinks.video is not None:
        started = perf_counter()
        sinks.video.write(result.composite)
        timings["encode"] = perf_counter() - started
    record = LogRecord.of(result.estimate, timings)
    if sinks.log is not None:
        sinks.log.write(record)
    if sinks.report is not None:
        sinks.report.add(record, result.composite)
    return record


class FrameProgress:
    """A progress line with frames per second and the share tracked, on standard error."""

    def __init__(self, work: Work) -> None:
        """Prepare the line."""
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._progress.add_task(work.title, total=work.frames, rate="")

    def __enter__(self) -> "FrameProgress":
        self._progress.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._progress.stop()

    def advance(self, statistics: RunStatistics) -> None:
        """Show the state after one more frame."""
        rate = f"{statistics.frames_per_second:.1f} frames/s, {100.0 * statistics.tracked_share:.0f} % tracked"
        self._progress.update(self._task, completed=statistics.frames, rate=rate)
