"""The front: what each setting costs and how wrong the picture is that it makes."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.speed.clip_errors import coefficient_errors, rms
from arlight.benchmark.speed.contest import Contender, contend, contender
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.front_settings import FrontSetting
from arlight.benchmark.speed.picture_errors import picture_error, reference_picture
from arlight.benchmark.speed.playback import TURN, FilmedClip
from arlight.benchmark.speed.relighters import FINEST, Relighters
from arlight.benchmark.speed.spread import Spread, block_means, paired_ratio, spread
from arlight.benchmark.speed.yardsticks import ArucoPose
from arlight.estimation.lighting import Lighting
from arlight.lighting_tracker import FrameEstimate
from arlight.synthetic.truth import FrameTruth
from arlight.video.frame import Frame

_JUDGED_EVERY = 5
"""Frames; no divisor of a cycle, so that each of its parts is judged."""
_BLOCK = 8
"""Frames over which costs are averaged before their median is taken: the light may be measured in every eighth only."""


@dataclass(frozen=True, slots=True)
class FrontPoint:
    """One setting, measured."""

    name: str
    """Of the setting."""
    is_preset: bool
    """Whether it is a preset."""
    cost_ms: Spread
    """CPU time a frame, from tracking to the composite [ms]."""
    stages_ms: dict[str, float]
    """Wall time of the estimation's stages and of drawing, medians [ms]."""
    estimate_over_aruco: Spread
    """Pose and light, relative to ArUco's detection and solvePnP on the same frames."""
    estimate_ms: float
    """Its part for pose and light, median [ms]."""
    relight_ms: float
    """Its part for drawing and compositing, median [ms]."""
    relighting_error: float
    """Error of what is seen, relative; see `picture_error`; geometric mean over the clips: each counts alike."""
    coefficient_error: float
    """Error of the light's coefficients of orders 1 and up, relative to |L~_0|; rms over the clips."""
    error_by_order: tuple[float, ...]
    """The same of each order, from 0, on the first clip."""
    on_front: bool = False
    """Whether no other setting is both cheaper and better."""


def measure_front(
    settings: Sequence[FrontSetting], clips: Sequence[FilmedClip], frames: int, relighters: Relighters
) -> Findings:
    """Cost and error of every setting.

    Args:
        settings: what is measured.
        clips: one size and sheet throughout.
        frames: how many of each clip, 8 at least.
        relighters: makes the drawers.

    Raises:
        RenderingUnavailableError: there is no headless OpenGL.
    """
    rows = [_measure_clip(settings, clip, frames, relighters) for clip in clips]
    points = [_point(setting, [row[number] for row in rows]) for number, setting in enumerate(settings)]
    best = pareto(np.array([[point.cost_ms.median, point.relighting_error] for point in points]))
    found = Findings(details={"front": []})
    for point, on_front in zip(points, best, strict=True):
        found.details["front"].append({**asdict(point), "on_front": bool(on_front)})
        if point.is_preset:
            ratio = Ratio(point.estimate_over_aruco, ArucoPose.name, point.estimate_ms)
            found.ratios[f"track to filter, preset {point.name}"] = ratio
            found.errors[f"relit picture, preset {point.name}"] = point.relighting_error
            found.errors[f"light, preset {point.name}"] = point.coefficient_error
    return found


@dataclass(frozen=True, slots=True)
class _Row:
    """One setting on one clip."""

    contender: Contender
    aruco_s: list[float]
    picture_error: float
    coefficients: float
    by_order: tuple[float, ...]


def _measure_clip(
    settings: Sequence[FrontSetting], clip: FilmedClip, frames: int, relighters: Relighters
) -> list[_Row]:
    contenders = [
        contender(
            clip,
            setting.preset.tracker,
            relighters.of(clip.probe, clip.camera, setting.preset.relight),
        )
        for setting in settings
    ]
    judge = _PictureJudge(clip, relighters, len(settings))
    aruco = ArucoPose(clip.probe, clip.camera)
    contest = contend(clip, frames, contenders, judge, lambda frame: aruco.pose(frame.luma()))
    rows = []
    for each, errors in zip(contenders, judge.errors, strict=True):
        light = coefficient_errors([estimate.lighting for estimate in each.estimates], contest.truth, clip.probe)
        rows.append(_Row(each, contest.yardstick_s, rms(np.array(errors)), light.together, light.orders))
    return rows


def _point(setting: FrontSetting, rows: Sequence[_Row]) -> FrontPoint:
    contenders = [row.contender for row in rows]
    frame_s, estimate_s, relight_s = (
        [mean for each in contenders for mean in block_means(getattr(each, name), _BLOCK)]
        for name in ("frame_s", "estimate_s", "relight_s")
    )
    aruco_s = [mean for row in rows for mean in block_means(row.aruco_s, _BLOCK)]
    return FrontPoint(
        name=setting.name,
        is_preset=setting.is_preset,
        cost_ms=spread(frame_s).scaled(1e3),
        stages_ms=_stages_ms(contenders),
        estimate_over_aruco=paired_ratio(estimate_s, aruco_s),
        estimate_ms=1e3 * spread(estimate_s).median,
        relight_ms=1e3 * spread(relight_s).median,
        relighting_error=_geometric_mean([row.picture_error for row in rows]),
        coefficient_error=rms(np.array([row.coefficients for row in rows])),
        error_by_order=rows[0].by_order,
    )


def _geometric_mean(errors: Sequence[float]) -> float:
    """Of positive errors; inf where one is not finite."""
    return float(np.exp(np.mean(np.log(errors)))) if np.all(np.isfinite(errors)) else float("inf")


def _stages_ms(contenders: Sequence[Contender]) -> dict[str, float]:
    """Median wall time of every stage [ms]."""
    stages: dict[str, list[float]] = {}
    for each in contenders:
        for estimate in each.estimates:
            for stage, seconds in estimate.timings_s.items():
                stages.setdefault(stage, []).append(seconds)
        stages.setdefault("relight", []).extend(each.relight_s)
    return {stage: 1e3 * spread(block_means(seconds, _BLOCK)).median for stage, seconds in stages.items()}


class _PictureJudge:
    """Compares some of the frames with the pictures that true pose and light make by the finest settings."""

    def __init__(self, clip: FilmedClip, relighters: Relighters, contenders: int) -> None:
        self._clip, self._finest = clip, relighters.of(clip.probe, clip.camera, FINEST)
        self._references: dict[int, Frame] = {}
        self.errors: list[list[float]] = [[] for _ in range(contenders)]
        """Of each contender's frames."""

    def __call__(self, number: int, estimate: FrameEstimate, frame: Frame, composite: Frame, truth: FrameTruth) -> None:
        if frame.index % _JUDGED_EVERY:
            return
        if estimate.lighting is None:
            self.errors[number].append(float("inf"))
            return
        reference = self._reference(estimate.lighting, frame, truth)
        self.errors[number].append(picture_error(frame, composite, reference))

    def _reference(self, lighting: Lighting, frame: Frame, truth: FrameTruth) -> Frame:
        """The frame as it should be, made once for all contenders; some lighting is needed for the light's units."""
        if frame.index not in self._references:
            # those of the turn before are not asked for again
            self._references = {i: of for i, of in self._references.items() if abs(i - frame.index) < TURN}
            self._references[frame.index] = reference_picture(self._finest, frame, truth, lighting, self._clip.probe)
        return self._references[frame.index]


def pareto(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of the points (n, 2) no other one beats: as good in both and better in one."""
    no_worse = np.all(points[None, :] <= points[:, None], axis=2)
    better = np.any(points[None, :] < points[:, None], axis=2)
    return ~np.any(no_worse & better, axis=1)
