"""A clip repeated without being encoded anew."""

import numpy as np
import pytest

from arlight.errors import VideoError
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader
from arlight.video.repetition import repeat_clip
from arlight.video.writer import VideoWriter

FRAMES = 5


@pytest.fixture
def short(tmp_path):
    path = tmp_path / "short.mp4"
    with VideoWriter(path, frame_rate=25, crf=0) as writer:
        for index in range(FRAMES):
            image = np.full((48, 64, 3), 40 * index + 20, np.uint8)
            image[8:24, 4 * index : 4 * index + 8] = 250
            writer.write(Frame.from_rgb(image, index, index / 25))
    return path


@pytest.mark.parametrize(("duration_s", "repeats"), [(0.01, 1), (0.2, 1), (0.21, 2), (1.0, 5)])
def test_every_repetition_shows_the_same_frames_at_a_steady_rate(short, tmp_path, duration_s, repeats):
    target = tmp_path / "long.mp4"
    assert repeat_clip(short, target, duration_s) == repeats * FRAMES
    with VideoReader(short) as reader:
        once = [frame.planes[0].copy() for frame in reader]
    with VideoReader(target) as reader:
        frames = list(reader)
        assert reader.damage is None
    assert len(frames) == repeats * FRAMES
    assert np.allclose(np.diff([frame.time_s for frame in frames]), 0.04)
    for frame in frames:
        assert np.array_equal(frame.planes[0], once[frame.index % FRAMES])


def test_what_is_no_clip_is_refused(tmp_path):
    text = tmp_path / "text.mp4"
    text.write_text("no clip")
    for source in (text, tmp_path / "none.mp4"):
        with pytest.raises(VideoError, match=source.name):
            repeat_clip(source, tmp_path / "long.mp4", 1.0)
