import numpy as np
import pytest

from arlight.errors import OutputError
from arlight.video.reader import VideoReader
from arlight.video.transcode import plain_transcode


def test_a_copy_has_every_frame_at_its_time(make_clip, tmp_path):
    clip = make_clip(frames=12, ticks=[0, 1, 3, 4, 5, 9, 10, 11, 12, 14, 15, 20])
    assert plain_transcode(clip, tmp_path / "copy.mp4", crf=1, preset="veryfast") == 12
    for a, b in zip(VideoReader(clip), VideoReader(tmp_path / "copy.mp4"), strict=True):
        assert a.time_s == pytest.approx(b.time_s, abs=1e-9)
        assert np.abs(a.planes[0].astype(int) - b.planes[0]).mean() < 0.5


def test_the_clip_itself_is_not_overwritten(make_clip):
    clip = make_clip()
    with pytest.raises(OutputError, match="also the input"):
        plain_transcode(clip, clip, crf=18, preset="ultrafast")
