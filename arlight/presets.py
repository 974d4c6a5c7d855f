"""Settings that go together: points on the measured front of speed against accuracy."""

from dataclasses import dataclass, field
from typing import Literal

from arlight.lighting_tracker import TrackerSettings
from arlight.rendering.settings import RelightSettings

PresetName = Literal["fast", "balanced", "accurate"]


@dataclass(frozen=True, slots=True)
class EncodingSettings:
    """How the relit video is compressed (H.264)."""

    preset: str = "ultrafast"
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
        TrackerSettings(samples_per_block=300),
        RelightSettings(directions=192, shadow_texels=64, supersampling=1),
    ),
    "balanced": Preset(),
    "accurate": Preset(
        TrackerSettings(samples_per_block=2400),
        RelightSettings(directions=1536, shadow_texels=256, supersampling=3),
        EncodingSettings("veryfast", 16),
    ),
}
"""What `--preset` chooses."""
