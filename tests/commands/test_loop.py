"""The loop over frames: what comes in goes out, once, in order, whatever ends it."""

import os
import signal

import numpy as np
import pytest

from arlight.commands.loop import Sinks, Work, run_frames
from arlight.errors import OutputError, VideoError
from arlight.lighting_tracker import FrameEstimate
from arlight.pipeline import FrameResult
from arlight.results.statistics import RunStatistics
from arlight.tracking.pose import ProbePose
from arlight.video.frame import Frame

PICTURE = np.zeros((8, 8, 3), np.uint8)


class Loop:
    """A pipeline that does nothing and sinks that remember; `disturb` is called with the index of every frame."""

    def __init__(self, disturb=lambda _index: None):
        self.written, self.logged, self.closed = [], [], []
        self._disturb = disturb
        self.statistics = RunStatistics()

    def process(self, frame):
        self._disturb(frame.index)
        return FrameResult(
            frame, FrameEstimate(frame.index, frame.time_s, ProbePose.lost(), None, None), {"track": 0.1}
        )

    def run(self, frames):
        with Sinks() as sinks:
            sinks.video = Sink(self.written, self.closed, "video")
            sinks.log = Sink(self.logged, self.closed, "log")
            return run_frames(frames, self, sinks, self.statistics, Work("test", None, source="decode"))


class Sink:
    def __init__(self, items, closed, name):
        self._items, self._closed, self._name = items, closed, name

    def write(self, item):
        self._items.append(item)

    def close(self):
        self._closed.append(self._name)


def frames(count):
    for index in range(count):
        yield Frame.from_rgb(PICTURE, index, index / 25)


@pytest.mark.parametrize("count", [0, 1, 2, 30])
def test_every_frame_is_written_and_logged_once_in_order(count):
    loop = Loop()
    assert loop.run(frames(count)) is False
    assert [frame.index for frame in loop.written] == list(range(count))
    assert [record.frame for record in loop.logged] == list(range(count))
    assert loop.statistics.frames == count
    assert sorted(loop.closed) == ["log", "video"]


def test_the_log_names_every_stage():
    loop = Loop()
    loop.run(frames(2))
    assert list(loop.logged[0].timings_ms) == ["decode", "track", "encode"]
    assert loop.logged[0].timings_ms["track"] == pytest.approx(100.0)


def test_an_interruption_ends_the_loop_after_the_frame_in_hand():
    def interrupt(index):
        if index == 5:
            os.kill(os.getpid(), signal.SIGINT)

    loop = Loop(interrupt)
    assert loop.run(frames(100)) is True
    assert [record.frame for record in loop.logged] == list(range(6))
    assert sorted(loop.closed) == ["log", "video"]


def test_an_error_of_the_source_comes_after_the_frames_before_it():
    def broken():
        yield from frames(4)
        raise VideoError("clip.mp4: broken")

    loop = Loop()
    with pytest.raises(VideoError, match=r"clip\.mp4: broken"):
        loop.run(broken())
    assert [record.frame for record in loop.logged] == [0, 1, 2, 3]
    assert loop.statistics.frames == 4
    assert sorted(loop.closed) == ["log", "video"]


def test_a_full_disk_ends_the_loop():
    loop = Loop()

    class FullSink(Sink):
        def write(self, _item):
            raise OutputError("relit.mp4: cannot be written")

    def run_onto_a_full_disk():
        with Sinks(video=FullSink(loop.written, loop.closed, "video")) as sinks:
            run_frames(frames(50), loop, sinks, loop.statistics, Work("test", None))

    with pytest.raises(OutputError, match=r"relit\.mp4"):
        run_onto_a_full_disk()
    assert loop.statistics.frames == 0
    assert loop.closed == ["video"]


def test_an_interrupt_that_insists_still_closes_the_files():
    def insist(index):
        if index == 3:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)

    loop = Loop(insist)
    with pytest.raises(KeyboardInterrupt):
        loop.run(frames(100))
    assert [record.frame for record in loop.logged] == [0, 1, 2]
    assert sorted(loop.closed) == ["log", "video"]
