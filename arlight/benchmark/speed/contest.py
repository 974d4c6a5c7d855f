"""Several settings on the same frames, taking turns frame by frame, so that all of them see the same machine."""

from collections.abc import Callable, Sequence
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


Judge = Callable[[int, Contender, Frame, Frame, FrameTruth], None]
"""Looks at a frame that was made: number of the contender, contender, frame, composite, truth."""


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
        contenders: take turns with every frame.
        judge: sees every frame that is measured.
        yardstick: takes its turn with every frame too.
        clock: CPU time of the process [s].
    """
    contest = Contest()
    with single_threaded():
        for frame, truth in clip.played(WARM_UP + frames):
            begun = clock()
            if yardstick is not None:
                yardstick(frame)
            if frame.index >= WARM_UP:
                contest.yardstick_s.append(clock() - begun)
                contest.truth.append(truth)
            for number, contender in enumerate(contenders):
                begun = clock()
                estimate = contender.pipeline.estimate(frame)
                estimated = clock()
                composite = contender.pipeline.relight(frame, estimate).composite
                relit = clock()
                if frame.index < WARM_UP:
                    continue
                contender.estimate_s.append(estimated - begun)
                contender.relight_s.append(relit - estimated)
                contender.estimates.append(estimate)
                if judge is not None:
                    judge(number, contender, frame, composite, truth)
    return contest


def contender(clip: FilmedClip, settings: TrackerSettings, relighter: Relighter) -> Contender:
    """Someone to contend on a clip."""
    return Contender(Pipeline(clip.probe, clip.camera, relighter, settings))
