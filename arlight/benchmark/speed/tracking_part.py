"""One workload: what tracking, measuring, estimating and filtering cost beside ArUco, and how right they are."""

from dataclasses import asdict
from time import process_time
from typing import Any

import numpy as np

from arlight.benchmark.speed.clip_errors import coefficient_errors, light_error, pose_errors_px, rms, true_lighting
from arlight.benchmark.speed.estimation_pass import Clock, EstimationPass, MakeTracker, evenly, run_estimation
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.spread import paired_ratio, spread
from arlight.benchmark.speed.yardsticks import PoseYardstick
from arlight.camera import Camera
from arlight.lighting_tracker import LightingTracker, TrackerSettings
from arlight.probe.design import Probe
from arlight.rendering.relight import Relighter

_SHOWN_FRAMES = 6


def usual_tracker(probe: Probe, camera: Camera, clock: Clock) -> LightingTracker:
    """The tracker with its default settings, for light of all orders that the sheet measures."""
    return LightingTracker(probe, camera, TrackerSettings(order=probe.order), clock=clock)


def measure_tracking(
    clip: FilmedClip,
    frames: int,
    yardstick: PoseYardstick,
    relighter: Relighter | None = None,
    make_tracker: MakeTracker = usual_tracker,
    clock: Clock = process_time,
) -> Findings:
    """Costs and errors on one clip.

    Args:
        clip: the workload.
        frames: how many are measured.
        yardstick: the other way to the pose, on the same frames in turns.
        relighter: shows what the light's error does to an object; None where there is no OpenGL.
        make_tracker: makes the tracker.
        clock: CPU time [s].
    """
    done = run_estimation(clip, frames, make_tracker, yardstick, clock)
    name, found = clip.workload.name, Findings()
    for stage, seconds in {**done.stages_s, "track to filter": done.cpu_s}.items():
        found.ratios[f"{stage}, {name}"] = _ratio(seconds, done.yardstick_s, yardstick.name)
    own, other = (
        pose_errors_px(poses, done.truth, clip.camera, clip.probe) for poses in (done.poses, done.yardstick_poses)
    )
    filtered, raw = (coefficient_errors(light, done.truth, clip.probe) for light in (done.filtered, done.raw))
    shown = float("nan") if relighter is None else _light_error(done, clip, relighter)
    found.errors[f"pose, {name}"] = rms(own)
    found.errors[f"light, {name}"] = filtered.together
    found.errors[f"light of one frame, {name}"] = raw.together
    if np.isfinite(shown):
        found.errors[f"lit object, {name}"] = shown
    found.details["workloads"] = [
        {
            "name": name,
            **_workload_facts(clip),
            "cpu_ms": {stage: asdict(spread(s).scaled(1e3)) for stage, s in done.stages_s.items()},
            "track_to_filter_cpu_ms": asdict(spread(done.cpu_s).scaled(1e3)),
            "track_to_filter_wall_ms": asdict(spread(done.wall_s).scaled(1e3)),
            "yardstick": yardstick.name,
            "yardstick_cpu_ms": asdict(spread(done.yardstick_s).scaled(1e3)),
            "pose_px": rms(own),
            "pose_found": float(np.mean(np.isfinite(own))),
            "yardstick_pose_px": rms(other),
            "yardstick_pose_found": float(np.mean(np.isfinite(other))),
            "error_by_order": list(filtered.orders),
            "error_by_order_one_frame": list(raw.orders),
            "lit_object_error": shown,
        }
    ]
    return found


def _ratio(seconds: list[float], yardstick_s: list[float], over: str) -> Ratio:
    return Ratio(paired_ratio(seconds, yardstick_s), over, 1e3 * spread(seconds).median)


def _light_error(done: EstimationPass, clip: FilmedClip, relighter: Relighter) -> float:
    """Median over some frames of the error that the object shows."""
    errors = []
    for index in evenly(range(len(done.estimates)), _SHOWN_FRAMES):
        light, truth = done.filtered[index], done.truth[index]
        if light is None:
            return float("inf")
        errors.append(light_error(relighter, light, true_lighting(light, truth, clip.probe), truth.pose))
    return float(np.median(errors))


def _workload_facts(clip: FilmedClip) -> dict[str, Any]:
    scene, sensor = clip.workload.scene, clip.workload.sensor
    return {
        "order": scene.order,
        "size": list(scene.size),
        "camera": scene.path,
        "light": scene.script,
        "environment": scene.environment,
        "sheet_width_px": scene.sheet_width_px,
        "blur_px": sensor.blur_px,
        "read_noise": sensor.read_noise,
        "shot_noise": sensor.gain,
        "crf": clip.workload.crf,
    }
