"""Small footage for the command line's tests."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from arlight.__main__ import main
from arlight.probe.layout import design_probe
from arlight.synthetic.clip import write_clip
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader
from arlight.video.writer import VideoWriter

FRAMES = 12


@dataclass(frozen=True)
class Finished:
    """What a command line did."""

    status: int
    output: str
    errors: str


@pytest.fixture
def arlight(capsys, monkeypatch, tmp_path, tmp_path_factory):
    """Runs the command line in an empty folder, its caches apart from the user's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "cache"))

    def run(*arguments: object) -> Finished:
        status = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Finished(status, captured.out, captured.err)

    return run


@pytest.fixture(scope="session")
def footage(tmp_path_factory) -> Path:
    """A folder with orbit.mp4 of an order-1 sheet, 320x240, its truth and its sidecars; nothing may write to it."""
    folder = tmp_path_factory.mktemp("footage")
    rate = Fraction(25)
    settings = SynthesisSettings(
        camera=default_camera((320, 240)),
        sheet_width_px=230.0,
        duration_s=float(FRAMES / rate),
        frame_rate=rate,
        bounces=0,
    )
    write_clip(folder, "orbit", settings, design_probe(1), preset="ultrafast")
    return folder


@pytest.fixture(scope="session")
def long_clip(footage) -> Path:
    """The clip back and forth for a minute, with the same sidecars."""
    path = footage / "long.mp4"
    with VideoReader(footage / "orbit.mp4") as reader:
        frames = list(reader)
    there_and_back = frames + frames[-2:0:-1]
    with VideoWriter(path, frame_rate=25) as writer:
        for index in range(1500):
            frame = there_and_back[index % len(there_and_back)]
            writer.write(Frame(index, index / 25, frame.planes, frame.format))
    return path


@pytest.fixture(scope="session")
def empty_table(footage) -> Path:
    """A clip of noise, with sidecars but no sheet."""
    path = footage / "table.mp4"
    generator = np.random.default_rng(3)
    with VideoWriter(path, frame_rate=25) as writer:
        for index in range(4):
            noise = generator.integers(90, 140, (240, 320, 3), dtype=np.uint8)
            writer.write(Frame.from_rgb(noise, index, index / 25))
    return path
