import os

from arlight.video.threads import codec_threads


def test_a_codec_leaves_processors_to_others(monkeypatch):
    if hasattr(os, "sched_getaffinity"):
        for usable, threads in ((1, 1), (2, 1), (3, 1), (4, 2), (16, 8)):
            monkeypatch.setattr(os, "sched_getaffinity", lambda _process, usable=usable: set(range(usable)))
            assert codec_threads() == threads
        monkeypatch.delattr(os, "sched_getaffinity")
    for count, threads in ((None, 1), (1, 1), (8, 4)):
        monkeypatch.setattr(os, "cpu_count", lambda count=count: count)
        assert codec_threads() == threads
