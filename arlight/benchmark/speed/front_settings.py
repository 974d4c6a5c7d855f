"""The settings whose cost and error are measured for the front: presets, every knob alone, and some together."""

from dataclasses import dataclass, replace
from typing import Any

from arlight.lighting_tracker import TrackerSettings
from arlight.presets import PRESETS, Preset


@dataclass(frozen=True, slots=True)
class FrontSetting:
    """A point to be measured."""

    name: str
    """In words."""
    preset: Preset
    """Settings of all stages."""
    is_preset: bool = False
    """Whether users know it by its name."""


def front_settings(quick: bool) -> tuple[FrontSetting, ...]:
    """The settings, presets first."""
    presets = [FrontSetting(name, preset, is_preset=True) for name, preset in PRESETS.items()]
    changes = _QUICK if quick else (*_QUICK, *_FULL)
    base = PRESETS["balanced"]
    return (*presets, *(FrontSetting(name, _changed(base, changed)) for name, changed in changes))


def _changed(base: Preset, changes: dict[str, Any]) -> Preset:
    """A preset with some knobs turned, each where it belongs."""
    tracker = {knob: value for knob, value in changes.items() if knob in TrackerSettings.__slots__}
    relight = {knob: value for knob, value in changes.items() if knob not in tracker}
    return replace(base, tracker=replace(base.tracker, **tracker), relight=replace(base.relight, **relight))


_QUICK: tuple[tuple[str, dict[str, Any]], ...] = (
    ("order 5", {"order": 5}),
    ("order 3", {"order": 3}),
    ("300 samples", {"samples_per_block": 300}),
    ("supersampling 1", {"supersampling": 1}),
)
_CHEAP: dict[str, Any] = {"supersampling": 1, "shadow_texels": 64}
_FULL: tuple[tuple[str, dict[str, Any]], ...] = (
    *((f"order {order}", {"order": order}) for order in (0, 1, 2, 4)),
    *((f"{count} samples", {"samples_per_block": count}) for count in (100, 600, 2400)),
    ("1 iteration", {"iterations": 1}),
    ("every frame", {"estimate_every": 1}),
    ("every 4 frames", {"estimate_every": 4}),
    ("supersampling 3", {"supersampling": 3}),
    ("shadow 64", {"shadow_texels": 64}),
    ("shadow 256", {"shadow_texels": 256}),
    ("192 directions", {"directions": 192}),
    ("4 000 triangles", {"mesh_faces": 4_000}),
    ("64 000 triangles", {"mesh_faces": 64_000}),
    *((f"cheap, every {every} frames", {**_CHEAP, "estimate_every": every}) for every in (2, 4, 8)),
    *((f"cheap, order {order}, every 4 frames", {**_CHEAP, "order": order, "estimate_every": 4}) for order in (1, 3)),
    ("64 000 triangles, every frame", {"mesh_faces": 64_000, "estimate_every": 1}),
    ("dear", {"samples_per_block": 600, "supersampling": 3, "mesh_faces": 64_000, "estimate_every": 1}),
)
