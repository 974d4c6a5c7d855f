"""Small videos made on the fly, in every awkward form."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

TAGS = {"matrix": 2, "range": 0, "transfer": 2, "primaries": 2}


def picture(size: tuple[int, int], index: int, seed: int = 3) -> np.ndarray:
    """A smooth colour picture (h, w, 3) uint8 that moves with `index`."""
    w, h = size
    y, x = np.mgrid[:h, :w]
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 6, 3)
    waves = [np.sin(x / 9 + phase[c] + index / 3) * np.cos(y / 7 - phase[c]) for c in range(3)]
    return np.clip(128 + 60 * np.stack(waves, axis=-1), 0, 255).astype(np.uint8)


@pytest.fixture
def make_clip(tmp_path: Path) -> Callable[..., Path]:
    """Encodes `frames` pictures; `ticks` are their times in units of `time_base`."""

    def make(
        name: str = "clip.mp4", size: tuple[int, int] = (64, 48), frames: int = 6, codec: str = "libx264",
        layout: str = "yuv420p", tags: dict[str, int] | None = None, ticks: list[int] | None = None,
        time_base: Fraction = Fraction(1, 30), rotation: int = 0, sound: str | None = None,
        options: dict[str, str] | None = None,
    ) -> Path:  # fmt: skip
        path, tag = tmp_path / name, TAGS | (tags or {})
        with av.open(str(path), "w") as out:
            stream = out.add_stream(codec, rate=30)
            stream.width, stream.height = size
            stream.pix_fmt = layout
            stream.options = options or {}
            context = stream.codec_context
            context.time_base = stream.time_base = time_base
            context.colorspace, context.color_range = tag["matrix"], tag["range"]
            context.color_trc, context.color_primaries = tag["transfer"], tag["primaries"]
            if rotation:
                stream.set_display_rotation(rotation)
            audio = out.add_stream(sound, rate=48000) if sound else None
            for i in range(frames):
                frame = av.VideoFrame.from_ndarray(picture(size, i), "rgb24").reformat(format=layout)
                frame.pts, frame.time_base = (ticks or range(frames))[i], time_base
                out.mux(stream.encode(frame))
            out.mux(stream.encode(None))
            if audio:
                _add_sound(out, audio, seconds=frames / 30)
        return path

    return make


def _add_sound(out: av.container.OutputContainer, stream: av.AudioStream, seconds: float) -> None:
    rng = np.random.default_rng(5)
    context = stream.codec_context
    planar, channels = context.format.is_planar, context.layout.nb_channels
    for k in range(int(seconds * 48000 / 1024) + 1):
        noise = rng.normal(0, 0.1, (channels, 1024) if planar else (1, 1024 * channels))
        is_float = context.format.name.startswith("flt")
        samples = noise.astype(np.float32) if is_float else (noise * 32767).astype(np.int16)
        frame = av.AudioFrame.from_ndarray(samples, context.format.name, context.layout.name)
        frame.sample_rate, frame.pts, frame.time_base = 48000, 1024 * k, Fraction(1, 48000)
        out.mux(stream.encode(frame))
    out.mux(stream.encode(None))
