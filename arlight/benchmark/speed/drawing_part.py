"""What drawing the lit object and setting it into the frame cost, beside drawing and converting whole frames."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from time import process_time
from typing import Any

from arlight.benchmark.speed.estimation_pass import Clock, run_estimation, single_threaded
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.spread import paired_ratio, spread
from arlight.benchmark.speed.tracking_part import usual_tracker
from arlight.benchmark.speed.whole_frames import (
    WholeFrameDrawing,
    convert_whole_frame,
    opengl_drawing,
    pyrender_drawing,
)
from arlight.errors import RenderingUnavailableError
from arlight.lighting_tracker import FrameEstimate
from arlight.rendering.relight import Relighter
from arlight.video.frame import Frame

OPENGL, PYRENDER, CONVERSION = "OpenGL, whole frame", "pyrender, whole frame", "whole frame to RGB and back"
_PYRENDER_EVERY = 4


@dataclass(slots=True)
class _Costs:
    """CPU time of every frame [s], by what was done."""

    seconds: dict[str, list[float]] = field(default_factory=dict)
    clock: Clock = process_time

    def time(self, name: str, work: Callable[[], Any]) -> float:
        begun = self.clock()
        work()
        taken = self.clock() - begun
        self.seconds.setdefault(name, []).append(taken)
        return taken


def measure_drawing(clip: FilmedClip, frames: int, relighter: Relighter, clock: Clock = process_time) -> Findings:
    """Costs of `render` (the object's picture) and `composite` (its shadow, and all into the frame) on one clip.

    Args:
        clip: the workload.
        frames: how many are measured.
        relighter: draws the object.
        clock: CPU time of the process [s].

    Raises:
        RenderingUnavailableError: there is no headless OpenGL.
    """
    found, costs = Findings(), _Costs(clock=clock)
    whole = {OPENGL: opengl_drawing(relighter, clip.probe, clip.camera)}
    try:
        whole[PYRENDER] = pyrender_drawing(relighter, clip.probe, clip.camera)
    except RenderingUnavailableError as error:
        found.notes.append(f"pyrender was left out: {error}")
    estimates = run_estimation(clip, frames, usual_tracker).estimates
    try:
        with single_threaded():
            for (frame, _truth), estimate in zip(clip.played(frames), estimates, strict=True):
                _measure_frame(frame, estimate, relighter, whole, costs)
    finally:
        for drawing in whole.values():
            drawing.release()
    _tell(found, clip.workload.name, costs.seconds)
    return found


def _measure_frame(
    frame: Frame,
    estimate: FrameEstimate,
    relighter: Relighter,
    whole: dict[str, WholeFrameDrawing],
    costs: _Costs,
) -> None:
    pose, light = estimate.pose.camera_from_probe, estimate.lighting
    if pose is None or light is None:
        return
    drawn = costs.time("render", lambda: relighter.draw_object(pose, light))
    together = costs.time("relight", lambda: relighter.render(frame, pose, light))
    costs.seconds.setdefault("composite", []).append(max(together - drawn, 0.0))
    costs.time(CONVERSION, lambda: convert_whole_frame(frame))
    for name, drawing in whole.items():
        if name != PYRENDER or frame.index % _PYRENDER_EVERY == 0:
            costs.time(name, lambda drawing=drawing: drawing.draw(pose, light))  # type: ignore[misc]


def _tell(found: Findings, workload: str, seconds: dict[str, list[float]]) -> None:
    # the first frame makes buffers
    costs = {name: values[1:] for name, values in seconds.items()}
    for stage, yardstick in (("render", OPENGL), ("composite", CONVERSION), ("relight", OPENGL)):
        ratios = paired_ratio(costs[stage], costs[yardstick])
        found.ratios[f"{stage}, {workload}"] = Ratio(ratios, yardstick, 1e3 * spread(costs[stage]).median)
    if PYRENDER in costs:
        own = seconds["relight"][::_PYRENDER_EVERY][1:]
        found.ratios[f"relight over pyrender, {workload}"] = Ratio(
            paired_ratio(own, costs[PYRENDER]), PYRENDER, 1e3 * spread(own).median
        )
    found.details["drawing"] = [
        {"name": workload, "cpu_ms": {name: asdict(spread(values).scaled(1e3)) for name, values in costs.items()}}
    ]
