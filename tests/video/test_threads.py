import os

from arlight.video.threads import decoder_threads, encoder_threads


def test_a_codec_leaves_processors_to_others(monkeypatch):
    if hasattr(os, "sched_getaffinity"):
        for usable, threads in ((1, 1), (2, 1), (3, 1), (4, 2), (16, 8)):
            monkeypatch.setattr(os, "sched_getaffinity", lambda _process, usable=usable: set(range(usable)))
            assert decoder_threads() == threads
            assert encoder_threads() == threads + 1
        monkeypatch.delattr(os, "sched_getaffinity")
    for count, threads in ((None, 1), (1, 1), (8, 4)):
        monkeypatch.setattr(os, "cpu_count", lambda count=count: count)
        assert decoder_threads() == threads
