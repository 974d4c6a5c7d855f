"""Several settings on the same frames, in turns of several, so that all of them see the same machine."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from time import process_time

from arlight.benchmark.speed.estimation_pass import WARM_UP, Clock, single_threaded
from arlight.benchmark.speed.playback import FilmedClip
from arlight.lighting_tracker import FrameEstimate, TrackerSettings
from arlight.pipeline import Pipeline
from arlight.rendering.relight import Relighter
from arlight.synthetic.truth import FrameTruth
from arlight.video.frame import Frame


@dataclass(slots=True)
class Contender:
    """One way to do a frame, and what its frames cost."""

    pipeline: Pipeline
    """Estimates and draws."""
    estimate_s: list[float] = field(default_factory=list)
    """CPU time of every estimate [s]."""
    relight_s: list[float] = field(default_factory=list)
    """CPU time of drawing and compositing every frame [s]."""
    estimates: list[FrameEstimate] = field(default_factory=list)
    """What each frame told."""

    def do(self, frame: Frame, measured: bool, clock: Clock) -> Frame:
        """Make the composite of the next frame; take down what it cost and told if it is measured."""
        begun = clock()
        estimate = self.pipeline.estimate(frame)
        estimated = clock()
        composite = self.pipeline.relight(frame, estimate).composite
        relit = clock()
        if measured:
            self.estimate_s.append(estimated - begun)
            self.relight_s.append(relit - estimated)
            self.estimates.append(estimate)
        return composite

    @property
    def frame_s(self) -> list[float]:
        """CPU time of every frame [s]."""
        return [a + b for a, b in zip(self.estimate_s, self.relight_s, strict=True)]


@dataclass(slots=True)
class Contest:
    """What all contenders had in common."""

    truth: list[FrameTruth] = field(default_factory=list)
    """Of every frame that was measured."""
    yardstick_s: list[float] = field(default_factory=list)
    """CPU time of the yardstick on every frame [s]."""


Judge = Callable[[int, FrameEstimate, Frame, Frame, FrameTruth], None]
"""Looks at a frame that was made: number of the contender, its estimate, frame, composite, truth."""


def contend(
    clip: FilmedClip,
    frames: int,
    contenders: Sequence[Contender],
    judge: Judge | None = None,
    yardstick: Callable[[Frame], object] | None = None,
    clock: Clock = process_time,
) -> Contest:
    """Play a clip to all contenders; costs and estimates after the warm-up stay with them.

    Args:
        clip: the frames.
        frames: how many are measured.
        contenders: take turns.
        judge: sees every frame that is measured.
        yardstick: takes its turn too.
        clock: CPU time of the process [s].
    """
    contest = Contest()
    with single_threaded():
        for turn in clip.turns(WARM_UP + frames):
            contest.truth.extend(truth for frame, truth in turn if frame.index >= WARM_UP)
            if yardstick is not None:
                contest.yardstick_s.extend(_timed(yardstick, turn, clock))
            for number, contender in enumerate(contenders):
                composites = [contender.do(frame, frame.index >= WARM_UP, clock) for frame, _ in turn]
                for (frame, truth), composite in zip(turn, composites, strict=True):
                    if judge is not None and frame.index >= WARM_UP:
                        judge(number, contender.estimates[frame.index - WARM_UP], frame, composite, truth)
    return contest


def _timed(work: Callable[[Frame], object], turn: Sequence[tuple[Frame, FrameTruth]], clock: Clock) -> Iterator[float]:
    """CPU time of the frames that are measured [s]."""
    for frame, _ in turn:
        begun = clock()
        work(frame)
        if frame.index >= WARM_UP:
            yield clock() - begun


def contender(clip: FilmedClip, settings: TrackerSettings, relighter: Relighter) -> Contender:
    """Someone to contend on a clip."""
    return Contender(Pipeline(clip.probe, clip.camera, relighter, settings))
