"""The loop as a command runs it: Ctrl-C, and totals that are right whatever ends it."""

import os
import signal

import numpy as np
import pytest

from arlight.commands.loop import Work, run_frames
from arlight.errors import OutputError, VideoError
from arlight.lighting_tracker import FrameEstimate
from arlight.pipeline import FrameResult
from arlight.results.frame_loop import Sinks
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

    def estimate(self, frame):
        self._disturb(frame.index)
        return FrameEstimate(frame.index, frame.time_s, ProbePose.lost(), None, None, timings_s={"track": 0.1})

    def relight(self, frame, estimate):
        return FrameResult(frame, estimate, estimate.timings_s)

    def release(self):
        pass

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


def test_a_loop_that_ends_by_itself_was_not_interrupted():
    loop = Loop()
    assert loop.run(frames(30)) is False
    assert loop.statistics.frames == len(loop.logged) == len(loop.written) == 30
    assert list(loop.statistics.median_ms) == ["decode", "track", "encode"]


def test_an_interruption_ends_the_loop_after_the_frames_in_hand():
    def interrupt(index):
        if index == 5:
            os.kill(os.getpid(), signal.SIGINT)

    loop = Loop(interrupt)
    assert loop.run(frames(1000)) is True
    indices = [record.frame for record in loop.logged]
    assert indices == [frame.index for frame in loop.written] == list(range(len(indices)))
    assert 6 <= len(indices) < 60
    assert loop.statistics.frames == len(indices)
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

    def run_until_insisted():
        # one signal may stand for both when they come at once: then the loop ends as asked
        if loop.run(frames(1000)):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_until_insisted()
    indices = [record.frame for record in loop.logged]
    assert indices == [frame.index for frame in loop.written] == list(range(len(indices)))
    assert len(indices) < 60
    assert sorted(loop.closed) == ["log", "video"]
