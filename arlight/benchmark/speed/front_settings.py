"""The settings whose cost and error are measured for the front: presets, every knob alone, and some together."""

from dataclasses import dataclass, replace
from typing import Any

from arlight.lighting_tracker import TrackerSettings
from arlight.presets import PRESETS, Preset
from arlight.rendering.settings import RelightSettings


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
    relight = {knob: value for knob, value in changes.items() if knob in RelightSettings.__slots__}
    return replace(base, tracker=replace(base.tracker, **tracker), relight=replace(base.relight, **relight))


_QUICK: tuple[tuple[str, dict[str, Any]], ...] = (
    ("order 3", {"order": 3}),
    ("300 samples", {"samples_per_block": 300}),
    ("supersampling 1", {"supersampling": 1}),
)
_FULL: tuple[tuple[str, dict[str, Any]], ...] = (
    *((f"order {order}", {"order": order}) for order in (0, 1, 2, 4)),
    *((f"{count} samples", {"samples_per_block": count}) for count in (100, 600, 2400)),
    ("supersampling 3", {"supersampling": 3}),
    ("shadow 64", {"shadow_texels": 64}),
    ("shadow 256", {"shadow_texels": 256}),
    ("192 directions", {"directions": 192}),
    ("order 3, 300 samples", {"order": 3, "samples_per_block": 300}),
    ("order 3, 300 samples, supersampling 1", {"order": 3, "samples_per_block": 300, "supersampling": 1}),
    ("order 2, 300 samples, supersampling 1", {"order": 2, "samples_per_block": 300, "supersampling": 1}),
    (
        "order 1, 100 samples, supersampling 1, shadow 64",
        {"order": 1, "samples_per_block": 100, "supersampling": 1, "shadow_texels": 64},
    ),
)
