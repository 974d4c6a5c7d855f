"""The order `auto` beside every fixed one: error of the picture, which orders are taken and what that costs."""

from collections.abc import Sequence

import numpy as np

from arlight.benchmark.speed.clip_errors import need_error, rms
from arlight.benchmark.speed.contest import Contender, contend, contender
from arlight.benchmark.speed.estimation_pass import Clock, run_estimation
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.relighters import Relighters
from arlight.benchmark.speed.spread import block_means, paired_ratio
from arlight.camera import Camera
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need
from arlight.lighting_tracker import LightingTracker, TrackerSettings
from arlight.probe.design import Probe
from arlight.rendering.settings import RelightSettings
from arlight.synthetic.truth import FrameTruth

OBJECTS = {
    "varnished": RelightSettings(),
    "matte": RelightSettings(roughness=1.0, normal_reflectance=0.0),
}
"""Looks of the default object."""
LEAST_FRAMES = 24
"""Frames over which costs are averaged: the order is thought over in every one of them; all orders are looked at in
every other one."""
_SETTLING = 72
"""Frames until a lower order has been taken where one suffices."""


def measure_order(clip: FilmedClip, frames: int, relighters: Relighters) -> Findings:
    """Error and cost of `auto` on one clip, for objects of several looks.

    Args:
        clip: the workload.
        frames: how many are measured once the order has settled, `LEAST_FRAMES` or more.
        relighters: makes the objects.

    Raises:
        RenderingUnavailableError: there is no headless OpenGL.
    """
    fixed = [_fixed_order(clip, order, _SETTLING + frames) for order in range(clip.probe.order + 1)]
    found = Findings(details={"order": []})
    for look, settings in OBJECTS.items():
        relighter = relighters.of(clip.probe, clip.camera, settings)
        everything, auto = (contender(clip, TrackerSettings(order=order), relighter) for order in ("all", "auto"))
        truth = contend(clip, _SETTLING + frames, [everything, auto]).truth
        by_order = [_picture_error(relighter.need, lights, truth) for lights in fixed]
        own = _picture_error(relighter.need, [estimate.lighting for estimate in auto.estimates], truth)
        name = f"{look}, {clip.workload.name}"
        found.errors[f"auto over the best order, {name}"] = own / min(by_order)
        found.ratios[f"auto over all orders, {name}"] = cost = _cost(auto, everything)
        found.details["order"].append(
            {
                "name": clip.workload.name,
                "object": look,
                "error_by_order": by_order,
                "error_of_auto": own,
                "over_best": own / min(by_order),
                "orders": _shares(auto, clip.probe.order),
                "cost_over_all_orders": cost.value.median,
            }
        )
    return found


def _fixed_order(clip: FilmedClip, order: int, frames: int) -> list[Lighting | None]:
    def tracker(probe: Probe, camera: Camera, clock: Clock) -> LightingTracker:
        return LightingTracker(probe, camera, TrackerSettings(order=order), clock=clock)

    return run_estimation(clip, frames, tracker).filtered


def _picture_error(need: Need, lights: Sequence[Lighting | None], truth: Sequence[FrameTruth]) -> float:
    """rms over the settled frames; inf where there is no light."""
    settled = list(zip(lights, truth, strict=True))[_SETTLING:]
    errors = [float("inf") if light is None else need_error(need, light, true) for light, true in settled]
    return float("inf") if np.isinf(errors).any() else rms(np.array(errors))


def _cost(auto: Contender, everything: Contender) -> Ratio:
    own, other = (block_means(each.frame_s[_SETTLING:], LEAST_FRAMES) for each in (auto, everything))
    return Ratio(paired_ratio(own, other), "all orders", 1e3 * float(np.median(own)))


def _shares(auto: Contender, highest: int) -> list[float]:
    """Share of the settled frames that are drawn with the light up to each order."""
    orders = [estimate.lighting.order for estimate in auto.estimates[_SETTLING:] if estimate.lighting is not None]
    return [float(share) for share in np.bincount(orders, minlength=highest + 1) / max(len(orders), 1)]
