"""The frame loop in threads: frames from their source through the pipeline into the files, one record a frame."""

from collections.abc import Generator, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from math import nan
from threading import Lock
from time import perf_counter
from types import TracebackType
from typing import Protocol

from arlight.chain import Chain, Stage
from arlight.lighting_tracker import FrameEstimate
from arlight.pipeline import FrameResult
from arlight.results.log import LightingLogWriter
from arlight.results.record import LogRecord
from arlight.results.report import ReportRecorder
from arlight.video.frame import Frame


class FrameStages(Protocol):
    """The halves of the work on a frame, such as a `Pipeline`'s."""

    def estimate(self, frame: Frame) -> FrameEstimate:
        """Pose and light of the next frame."""

    def relight(self, frame: Frame, estimate: FrameEstimate) -> FrameResult:
        """The frame with the lit object in it."""

    def release(self) -> None:
        """Give back what belongs to the thread that relights."""


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


class FrameLoop:
    """The loop, to be started by a `with` block and driven by taking its records.

    Decoding, estimating and relighting (which alone touches OpenGL) have a thread each; writing is done by the thread
    that takes the records. A record comes when its frame is in the files.
    """

    def __init__(
        self,
        frames: Iterable[Frame],
        pipeline: FrameStages,
        sinks: Sinks,
        source: str = "decode",
        deadline: bool = False,
    ) -> None:
        """Prepare the threads.

        Args:
            frames: in order.
            pipeline: what is done with each.
            sinks: where the results go; to be closed after the loop.
            source: name of the stage that the frames come from.
            deadline: whether a frame in work matters more than how many there are: estimating and relighting then
                share a thread, and decoding and writing take turns, so that of two processors one is for the frame.
        """
        self._pipeline, self._sinks, self._source = pipeline, sinks, source
        self._coding: AbstractContextManager[object] = Lock() if deadline else nullcontext()
        stages = [Stage("estimate", self._estimate), Stage("relight", self._relight, pipeline.release)]
        if deadline:
            stages = [Stage("frame", lambda taken: self._relight(self._estimate(taken)), pipeline.release)]
        self._chain: Chain[tuple[FrameResult, float]] = Chain(self._timed(frames), stages)
        self._finished_s = nan

    def stop(self) -> None:
        """Take no more frames; the records of those already taken still come."""
        self._chain.stop()

    def __enter__(self) -> "FrameLoop":
        self._chain.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._chain.__exit__(kind, error, trace)

    def __iter__(self) -> Iterator[LogRecord]:
        for result, source_s in self._chain:
            yield self._write(result, source_s)

    # what the threads hand on carries the seconds that the source took

    def _estimate(self, taken: tuple[Frame, float]) -> tuple[Frame, float, FrameEstimate]:
        frame, source_s = taken
        return frame, source_s, self._pipeline.estimate(frame)

    def _relight(self, estimated: tuple[Frame, float, FrameEstimate]) -> tuple[FrameResult, float]:
        frame, source_s, estimate = estimated
        return self._pipeline.relight(frame, estimate), source_s

    def _write(self, result: FrameResult, source_s: float) -> LogRecord:
        timings = {self._source: source_s, **result.timings_s}
        if self._sinks.video is not None and result.pose.status != "left out":
            with self._coding:
                started = perf_counter()
                self._sinks.video.write(result.composite)
                timings["encode"] = perf_counter() - started
        before, self._finished_s = self._finished_s, perf_counter()
        record = LogRecord.of(result.estimate, timings, self._finished_s - before)
        if self._sinks.log is not None:
            self._sinks.log.write(record)
        if self._sinks.report is not None:
            self._sinks.report.add(record, result.composite)
        return record

    def _timed(self, frames: Iterable[Frame]) -> Generator[tuple[Frame, float], None, None]:
        """Every frame with the seconds that its source took for it; a source that can be closed is."""
        iterator = iter(frames)
        try:
            while True:
                with self._coding:
                    started = perf_counter()
                    frame = next(iterator, None)
                    source_s = perf_counter() - started
                if frame is None:
                    return
                yield frame, source_s
        finally:
            close = getattr(iterator, "close", None)
            if close is not None:
                close()
