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
    "fast": Preset(
        TrackerSettings(samples_per_block=200, estimate_every=3),
        RelightSettings(directions=256, shadow_texels=64, supersampling=1, mesh_faces=8_000),
    ),
    "balanced": Preset(),
    "accurate": Preset(
        TrackerSettings(samples_per_block=2400, iterations=4, order="all"),
        RelightSettings(directions=1536, shadow_texels=192, supersampling=4, mesh_faces=64_000),
        EncodingSettings("veryfast", 16),
    ),
}
"""What `--preset` chooses."""

_LEAN = Effort(samples_per_block=200, supersampling=1)
LADDER: tuple[Rung, ...] = (
    Rung(Effort(), 1.0, 1.0),
    Rung(Effort(supersampling=1), 1.0, 0.88),
    Rung(_LEAN, 0.85, 0.88),
    Rung(replace(_LEAN, estimate_every=2), 0.55, 0.88),
    Rung(replace(_LEAN, estimate_every=4, order=3), 0.35, 0.85),
    Rung(replace(_LEAN, estimate_every=4, order=3, shadow=False), 0.35, 0.45),
    Rung(replace(_LEAN, estimate_every=8, order=2, shadow=False), 0.3, 0.42),
)
"""What a deadline gives up, step by step, from the settings as they are, with what each step costs of the whole."""
