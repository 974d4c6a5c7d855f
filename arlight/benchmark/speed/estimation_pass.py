"""Frames through the estimation with its stages timed, in turns with a yardstick, and what came of them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter, process_time

import cv2
from threadpoolctl import threadpool_limits

from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.yardsticks import PoseYardstick
from arlight.camera import Camera, Pose
from arlight.estimation.lighting import Lighting
from arlight.lighting_tracker import FrameEstimate, LightingTracker
from arlight.probe.design import Probe
from arlight.synthetic.truth import FrameTruth

WARM_UP = 10
"""Frames until caches are warm, the sheet is followed and the light's filter has settled."""
STAGES = ("track", "measure", "estimate", "filter")
"""Stages of the estimation, in order."""

Clock = Callable[[], float]
MakeTracker = Callable[[Probe, Camera, Clock], LightingTracker]


@dataclass(slots=True)
class EstimationPass:
    """Costs and results of the frames after the first, frame by frame."""

    stages_s: dict[str, list[float]] = field(default_factory=dict)
    """CPU time of every stage [s]."""
    cpu_s: list[float] = field(default_factory=list)
    """CPU time of them all [s]."""
    wall_s: list[float] = field(default_factory=list)
    """Wall time of them all [s]."""
    yardstick_s: list[float] = field(default_factory=list)
    """CPU time of the yardstick on the same frames; empty without one [s]."""
    estimates: list[FrameEstimate] = field(default_factory=list)
    """What each frame told."""
    yardstick_poses: list[Pose | None] = field(default_factory=list)
    """What the yardstick told; empty without one."""
    truth: list[FrameTruth] = field(default_factory=list)
    """What is true."""

    def add(self, estimate: FrameEstimate, truth: FrameTruth, cpu_s: float, wall_s: float) -> None:
        """Take down a frame."""
        for stage, seconds in estimate.timings_s.items():
            self.stages_s.setdefault(stage, []).append(seconds)
        self.cpu_s.append(cpu_s)
        self.wall_s.append(wall_s)
        self.estimates.append(estimate)
        self.truth.append(truth)

    @property
    def poses(self) -> list[Pose | None]:
        """Poses that were tracked."""
        return [estimate.pose.camera_from_probe for estimate in self.estimates]

    @property
    def raw(self) -> list[Lighting | None]:
        """Each frame's own light."""
        return [estimate.raw for estimate in self.estimates]

    @property
    def filtered(self) -> list[Lighting | None]:
        """Light averaged over time."""
        return [estimate.lighting for estimate in self.estimates]


def run_estimation(
    clip: FilmedClip,
    frames: int,
    make_tracker: MakeTracker,
    yardstick: PoseYardstick | None = None,
    clock: Clock = process_time,
) -> EstimationPass:
    """Play a clip through the estimation.

    Args:
        clip: the frames.
        frames: how many are measured, after the warm-up.
        make_tracker: the tracker of a sheet and camera, timing its stages by the clock it is given.
        yardstick: measured on the same frames, in turns of several.
        clock: CPU time of the process [s].
    """
    tracker = make_tracker(clip.probe, clip.camera, clock)
    done = EstimationPass()
    with single_threaded():
        for turn in clip.turns(WARM_UP + frames):
            for frame, truth in turn:
                wall, begun = perf_counter(), clock()
                estimate = tracker.update(frame)
                cpu, wall = clock() - begun, perf_counter() - wall
                if frame.index >= WARM_UP:
                    done.add(estimate, truth, cpu, wall)
            if yardstick is None:
                continue
            for frame, _ in turn:
                begun = clock()
                pose = yardstick.pose(frame.luma())
                if frame.index >= WARM_UP:
                    done.yardstick_s.append(clock() - begun)
                    done.yardstick_poses.append(pose)
    return done


@contextmanager
def single_threaded() -> Iterator[None]:
    """One thread for OpenCV and for BLAS within the `with` block, so that all work is counted alike."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            yield
    finally:
        cv2.setNumThreads(before)


def evenly(items: Sequence[int], count: int) -> list[int]:
    """At most `count` of the items, spread over them."""
    step = max(1, -(-len(items) // count))
    return list(items[::step])
