"""Deadlines on a clip whose truth is known: how many frames are in time, and how right the pictures are."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.picture_errors import picture_error, reference_picture
from arlight.benchmark.speed.playback import FilmedClip
from arlight.budget import BudgetController
from arlight.lighting_tracker import FrameEstimate
from arlight.pipeline import FrameResult, Pipeline
from arlight.presets import LADDER, PRESETS
from arlight.rendering.relight import Relighter
from arlight.results.frame_loop import FrameLoop, Sinks
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader
from arlight.video.repetition import repeat_clip
from arlight.video.writer import VideoWriter

BUDGETS_MS = (33.0, 16.0, 8.0)
_JUDGED_EVERY = 13
_SETTLED = 24
"""Frames until the machine's speed is known."""


@dataclass(slots=True)
class _JudgedPipeline:
    """A pipeline that keeps some of its results."""

    pipeline: Pipeline
    """What is judged."""
    kept: list[tuple[Frame, FrameResult]] = field(default_factory=list)
    """Frames and what was made of them."""

    def estimate(self, frame: Frame) -> FrameEstimate:
        """As the pipeline's."""
        return self.pipeline.estimate(frame)

    def relight(self, frame: Frame, estimate: FrameEstimate) -> FrameResult:
        """As the pipeline's; once in a while the result is kept."""
        result = self.pipeline.relight(frame, estimate)
        if frame.index >= _SETTLED and frame.index % _JUDGED_EVERY == 0:
            self.kept.append((frame, result))
        return result

    def release(self) -> None:
        """As the pipeline's."""
        self.pipeline.release()


def measure_budgets(
    clip: FilmedClip,
    length_s: float,
    relighter: Relighter,
    finest: Relighter,
    folder: Path,
    budgets_ms: Sequence[float] = BUDGETS_MS,
) -> Findings:
    """Run the loop under one deadline after the other.

    Args:
        clip: the workload; it is repeated without being encoded anew.
        length_s: of what is run [s].
        relighter: draws the object; made with the balanced settings.
        finest: draws what the pictures are compared with.
        folder: for the clips that are written.
        budgets_ms: the deadlines [ms].
    """
    path = folder / "deadline.mp4"
    frames = repeat_clip(clip.path, path, length_s)
    found = Findings(details={"budget": []})
    for budget_ms in budgets_ms:
        controller = BudgetController(budget_ms / 1e3, LADDER)
        balanced = PRESETS["balanced"]
        pipeline = _JudgedPipeline(Pipeline(clip.probe, clip.camera, relighter, balanced.tracker, budget=controller))
        _run(path, pipeline, folder / "relit.mp4")
        error = _median_error(clip, pipeline.kept, finest)
        in_time = (int(controller.frames_at.sum()) - controller.late) / frames
        found.errors[f"relit picture, {budget_ms:g} ms a frame"] = error
        found.errors[f"late or left out, {budget_ms:g} ms a frame"] = 1.0 - in_time
        found.details["budget"].append(
            {
                "budget_ms": budget_ms,
                "frames": frames,
                "in_time": in_time,
                "late": controller.late,
                "left_out": controller.left_out,
                "frames_at_rung": controller.frames_at.tolist(),
                "relighting_error": error,
            }
        )
    return found


def _run(path: Path, pipeline: _JudgedPipeline, output: Path) -> None:
    encoding = PRESETS["balanced"].encoding
    with (
        VideoReader(path) as reader,
        VideoWriter(output, like=reader, crf=encoding.crf, preset=encoding.encoder_preset) as video,
        FrameLoop(reader, pipeline, Sinks(video), deadline=True) as records,
    ):
        for _ in records:
            pass


def _median_error(clip: FilmedClip, kept: Sequence[tuple[Frame, FrameResult]], finest: Relighter) -> float:
    """Of the pictures that were made; inf where none was."""
    errors = []
    for frame, result in kept:
        if result.pose.status == "left out" or result.lighting is None:
            continue
        truth = clip.truth[frame.index % len(clip.truth)]
        reference = reference_picture(finest, frame, truth, result.lighting, clip.probe)
        errors.append(picture_error(frame, result.composite, reference))
    return float(np.nanmedian(errors)) if errors else float("inf")
