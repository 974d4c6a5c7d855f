"""Settings that go together: points on the measured front of speed against accuracy."""

from dataclasses import dataclass, field, replace
from typing import Literal

from arlight.budget import Rung
from arlight.effort import Effort
from arlight.rendering.settings import RelightSettings
from arlight.tracker_settings import TrackerSettings

PresetName = Literal["fast", "balanced", "accurate"]


EncoderPreset = Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"]


@dataclass(frozen=True, slots=True)
class EncodingSettings:
    """How the relit video is compressed (H.264)."""

    encoder_preset: EncoderPreset = "ultrafast"
    """Time spent on compression: slower presets of libx264 make smaller files."""
    crf: int = 18
    """Quality, 0 (lossless) to 51; lower is better and larger."""


@dataclass(frozen=True, slots=True)
class Preset:
    """Settings of all stages."""

    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    """Of the estimation."""
    relight: RelightSettings = field(default_factory=RelightSettings)
    """Of the drawing."""
    encoding: EncodingSettings = field(default_factory=EncodingSettings)
    """Of the video."""


PRESETS: dict[PresetName, Preset] = {
    "fast": Preset(TrackerSettings(estimate_every=8)),
    "balanced": Preset(TrackerSettings(estimate_every=2)),
    "accurate": Preset(
        TrackerSettings(estimate_every=2),
        RelightSettings(directions=1024, shadow_texels=192, supersampling=3, mesh_faces=64_000),
        EncodingSettings("veryfast", 16),
    ),
}
"""What `--preset` chooses."""

_SPARING = Effort(supersampling=1, estimate_every=16)
LADDER: tuple[Rung, ...] = (
    Rung(Effort(), 1.0, 1.0),
    Rung(Effort(estimate_every=4), 0.73, 1.0),
    Rung(Effort(supersampling=1, estimate_every=4), 0.7, 0.9),
    Rung(Effort(supersampling=1, estimate_every=8), 0.54, 0.9),
    Rung(_SPARING, 0.44, 0.9),
    Rung(replace(_SPARING, shadow=False), 0.44, 0.65),
    Rung(replace(_SPARING, order=3, shadow=False), 0.36, 0.65),
)
"""What a deadline gives up, step by step, from the settings as they are. Costs, and errors that rise from rung to rung,
were measured on the workloads of the front."""
