"""Frames through the pipeline into the outputs, with progress, until they end or Ctrl-C."""

import gc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn
from threadpoolctl import threadpool_limits

from arlight.commands.interruption import Interruption
from arlight.results.frame_loop import FrameLoop, FrameStages, Sinks
from arlight.results.statistics import RunStatistics
from arlight.video.frame import Frame


@dataclass(frozen=True, slots=True)
class Work:
    """What a loop is about."""

    title: str
    """Name in the progress line."""
    frames: int | None
    """Frames to expect; None where that is not known."""
    source: str = "decode"
    """Name of the stage that the frames come from."""
    deadline: bool = False
    """Whether each frame is to be done in time, rather than all of them soon."""


def run_frames(
    frames: Iterable[Frame], pipeline: FrameStages, sinks: Sinks, statistics: RunStatistics, work: Work
) -> bool:
    """The loop: decode, estimate, relight, encode, log; Ctrl-C ends it after the frames in hand.

    Args:
        frames: in order.
        pipeline: what is done with each.
        sinks: where the results go.
        statistics: counts the frames; up to date after each, whatever ends the loop.
        work: what the progress line shows.

    Returns:
        Whether it was interrupted.
    """
    with (
        Interruption() as interruption,
        FrameProgress(work) as progress,
        settled_memory(),
        threadpool_limits(limits=1, user_api="blas"),
        FrameLoop(frames, pipeline, sinks, work.source, work.deadline) as records,
    ):
        for record in records:
            statistics.add(record)
            progress.advance(statistics)
            if interruption.requested:
                records.stop()
    return interruption.requested


@contextmanager
def settled_memory() -> Iterator[None]:
    """What was made before the `with` block is not searched for garbage within it: that would hold up frames."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


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
