"""Frames through the pipeline into the outputs, with progress, until they end or Ctrl-C."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from time import perf_counter
from types import TracebackType
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

from arlight.commands.interruption import Interruption
from arlight.pipeline import Pipeline
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
    frames: Iterable[Frame], pipeline: Pipeline, sinks: Sinks, statistics: RunStatistics, title: str, count: int | None
) -> bool:
    """The loop: decode, process, encode, log; Ctrl-C ends it after the frame in hand.

    Args:
        frames: in order.
        pipeline: what is done with each.
        sinks: where the results go.
        statistics: counts the frames; up to date after each, whatever ends the loop.
        title: names the work in the progress line.
        count: frames to expect; None where that is not known.

    Returns:
        Whether it was interrupted.
    """
    with Interruption() as interruption, FrameProgress(title, count) as progress:
        for frame, decode_s in _timed(frames):
            record = _process(frame, decode_s, pipeline, sinks)
            statistics.add(record)
            progress.advance(statistics)
            if interruption.requested:
                break
    return interruption.requested


def _process(frame: Frame, decode_s: float, pipeline: Pipeline, sinks: Sinks) -> LogRecord:
    result = pipeline.process(frame)
    timings = {"decode": decode_s, **result.timings_s}
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

    def __init__(self, title: str, frame_count: int | None) -> None:
        """Prepare the line.

        Args:
            title: what is being done.
            frame_count: frames to expect; None where that is not known.
        """
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._progress.add_task(title, total=frame_count, rate="")

    def __enter__(self) -> "FrameProgress":
        self._progress.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._progress.stop()

    def advance(self, statistics: RunStatistics) -> None:
        """Show the state after one more frame."""
        rate = f"{statistics.frames_per_second:.1f} frames/s, {100.0 * statistics.tracked_share:.0f} % tracked"
        self._progress.update(self._task, completed=statistics.frames, rate=rate)


def _timed(frames: Iterable[Frame]) -> Iterator[tuple[Frame, float]]:
    """Each frame with the seconds it took to come."""
    iterator = iter(frames)
    while True:
        started = perf_counter()
        frame = next(iterator, None)
        if frame is None:
            return
        yield frame, perf_counter() - started
