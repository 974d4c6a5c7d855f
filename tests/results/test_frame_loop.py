"""The loop over frames: what comes in goes out, once, in order, whatever ends it, and in constant memory."""

import gc
import threading
import time
import tracemalloc

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.errors import OutputError, VideoError
from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies
from arlight.lighting_tracker import FrameEstimate
from arlight.optics import Slab
from arlight.pipeline import FrameResult
from arlight.results.frame_loop import FrameLoop, Sinks
from arlight.results.log import LightingLogWriter
from arlight.results.record import LogHeader
from arlight.results.report import ReportRecorder
from arlight.results.statistics import RunStatistics
from arlight.tracking.pose import ProbePose
from arlight.video.frame import Frame

PICTURE = np.zeros((8, 8, 3), np.uint8)
FREQUENCIES = half_plane_frequencies(1)


def frames(count):
    for index in range(count):
        yield Frame.from_rgb(PICTURE, index, index / 25)


def estimate_of(frame, lighting=None):
    return FrameEstimate(frame.index, frame.time_s, ProbePose.lost(), lighting, None, timings_s={"track": 0.1})


class Stages:
    """Does nothing but mark the composite; fails at a frame where asked to."""

    def __init__(self, failing="", at=-1):
        self._failing, self._at = failing, at
        self.threads = {}

    def estimate(self, frame):
        self._note("estimate", frame.index)
        return estimate_of(frame)

    def relight(self, frame, estimate):
        self._note("relight", frame.index)
        composite = Frame.from_rgb(PICTURE + np.uint8(1), frame.index, frame.time_s)
        return FrameResult(composite, estimate, estimate.timings_s | {"render": 0.2})

    def release(self):
        self.threads["release"] = threading.get_ident()

    def _note(self, name, index):
        self.threads.setdefault(name, threading.get_ident())
        assert self.threads[name] == threading.get_ident()
        if self._failing == name and self._at == index:
            raise ArithmeticError(f"{name} {index}")


class Sink:
    def __init__(self, error=None, at=-1):
        self.items, self.closed = [], 0
        self._error, self._at = error, at

    def write(self, item):
        if len(self.items) == self._at:
            raise self._error
        self.items.append(item)

    def close(self):
        self.closed += 1


def run(source, stages, video, log, deadline=False):
    records = []
    with Sinks(video=video, log=log) as sinks, FrameLoop(source, stages, sinks, "decode", deadline) as loop:
        records.extend(loop)
    return records


@pytest.mark.parametrize("deadline", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 30])
def test_every_frame_is_written_and_logged_once_in_order(count, deadline):
    video, log, stages = Sink(), Sink(), Stages()
    records = run(frames(count), stages, video, log, deadline)
    assert [frame.index for frame in video.items] == list(range(count))
    assert all(frame.planes[0][0, 0] == 1 for frame in video.items)
    assert log.items == records
    assert [record.frame for record in records] == list(range(count))
    assert (video.closed, log.closed) == (1, 1)


def test_relighting_has_one_thread_that_gives_back_what_it_holds():
    stages = Stages()
    run(frames(5), stages, Sink(), Sink())
    assert stages.threads["release"] == stages.threads["relight"]
    assert stages.threads["relight"] not in (stages.threads["estimate"], threading.get_ident())


def test_with_a_deadline_a_frame_has_one_thread_and_decoding_and_writing_take_turns():
    under_way, together = [], []

    def alone():
        under_way.append(threading.get_ident())
        time.sleep(0.002)
        together.append(len(under_way))
        under_way.pop()

    def source():
        for frame in frames(20):
            alone()
            yield frame

    class SlowSink(Sink):
        def write(self, item):
            alone()
            super().write(item)

    stages, video = Stages(), SlowSink()
    run(source(), stages, video, Sink(), deadline=True)
    assert stages.threads["relight"] == stages.threads["estimate"] == stages.threads["release"]
    assert len(video.items) == 20
    assert max(together) == 1


def test_a_record_has_the_time_of_every_stage_and_of_the_whole():
    records = run(frames(3), Stages(), Sink(), Sink())
    assert list(records[0].timings_ms) == ["decode", "track", "render", "encode"]
    assert records[0].timings_ms["track"] == pytest.approx(100.0)
    assert np.isnan(records[0].wall_ms)
    assert all(record.wall_ms > 0.0 for record in records[1:])


def test_without_a_video_nothing_is_encoded():
    assert list(run(frames(1), Stages(), None, None)[0].timings_ms) == ["decode", "track", "render"]


@pytest.mark.parametrize("at", [0, 1, 9])
@pytest.mark.parametrize("failing", ["decode", "estimate", "relight", "video", "log"])
def test_an_error_anywhere_ends_the_loop_and_closes_complete_files(failing, at):
    def source():
        for frame in frames(1000):
            if failing == "decode" and frame.index == at:
                raise VideoError("clip.mp4: broken")
            yield frame

    full = OutputError("cannot be written")
    video = Sink(full, at if failing == "video" else -1)
    log = Sink(full, at if failing == "log" else -1)
    with pytest.raises((VideoError, ArithmeticError, OutputError)):
        run(source(), Stages(failing, at), video, log)
    assert [record.frame for record in log.items] == list(range(at))
    # a log that fails does so after the picture is in the video
    assert len(video.items) == at + (failing == "log")
    assert (video.closed, log.closed) == (1, 1)


@pytest.mark.parametrize("ending", ["stop", "error"])
def test_files_are_in_step_whatever_the_consumer_does(ending):
    video, log = Sink(), Sink()

    def consume():
        with Sinks(video=video, log=log) as sinks, FrameLoop(frames(1000), Stages(), sinks) as loop:
            for record in loop:
                if record.frame == 20:
                    if ending == "error":
                        raise KeyboardInterrupt
                    loop.stop()

    if ending == "error":
        with pytest.raises(KeyboardInterrupt):
            consume()
    else:
        consume()
    assert [frame.index for frame in video.items] == [record.frame for record in log.items]
    assert 21 <= len(log.items) < 60
    assert (video.closed, log.closed) == (1, 1)


class Lit(Stages):
    """Every frame with new lighting, as a tracker has it."""

    def estimate(self, frame):
        k = len(FREQUENCIES)
        coefficients = np.full((k, 3), frame.index + 1j)
        covariance = np.tile(np.eye(2 * k - 1), (3, 1, 1))
        return estimate_of(frame, Lighting(FREQUENCIES, coefficients, covariance, frame.time_s, 1.0))


def test_memory_does_not_grow_with_the_clip(tmp_path):
    camera = Camera((8, 8), [[9.0, 0, 3.5], [0, 9.0, 3.5], [0, 0, 1]], np.zeros(5))
    header = LogHeader(FREQUENCIES, camera, Slab(), (12.0, 9.0), "clip", "probe")
    statistics, used = RunStatistics(), []

    class Forget:
        def write(self, _frame):
            pass

        def close(self):
            pass

    tracemalloc.start()
    try:
        log = LightingLogWriter(tmp_path / "log.jsonl", header)
        with (
            Sinks(Forget(), log, ReportRecorder(header)) as sinks,
            FrameLoop(frames(3_000), Lit(), sinks) as loop,
        ):
            for record in loop:
                statistics.add(record)
                # at the same fill of samples that are halved again and again
                if record.frame in (1_499, 2_999):
                    gc.collect()
                    used.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert statistics.frames == 3_000
    # remembering every frame would take seven times this
    assert used[1] - used[0] < 0.3e6
