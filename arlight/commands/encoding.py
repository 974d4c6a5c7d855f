"""How a command's video is compressed."""

from dataclasses import dataclass
from typing import Literal

Preset = Literal["ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"]


@dataclass(frozen=True)
class EncodingOptions:
    """How the video is compressed (H.264)."""

    crf: int = 18
    """Quality, 0 (lossless) to 51; lower is better and larger."""
    preset: Preset = "ultrafast"
    """Time spent on compression: slower presets make smaller files."""
