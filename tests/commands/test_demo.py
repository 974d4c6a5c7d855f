"""`arlight demo`: the loop without a camera."""

import pytest

from arlight.results.log import read_log
from arlight.video.reader import VideoReader

QUICK = ("--order", 1, "--directions", 48, "--shadow-texels", 16, "--supersampling", 1)


def test_frames_are_synthesised_tracked_relit_and_written(arlight, tmp_path):
    done = arlight("demo", "--seconds", 0.08, "--lighting", "demo.jsonl", *QUICK)
    assert done.status == 0, done.errors
    with VideoReader(tmp_path / "demo.mp4") as reader:
        assert reader.size == (1280, 720)
        assert len(list(reader)) == 2
    log = read_log(tmp_path / "demo.jsonl")
    assert [record.status for record in log.records] == ["tracked", "tracked"]
    assert "synthesise" in log.records[0].timings_ms
    assert "demo.mp4" in done.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--environment", "nowhere"], "nowhere: no such environment"),
        (["--environment", "map.hdr"], "map.hdr: not a readable"),
        (["--output", "demo.avi"], "demo.avi: expected a name"),
        (["--output", "map.hdr", "--environment", "map.hdr"], "map.hdr"),
        (["--lighting", "map.hdr", "--environment", "map.hdr"], "map.hdr: --lighting would overwrite this input"),
        (["--seconds", "-1"], "-1.0"),
        (["--order", "9"], "order must lie between 1 and 8"),
        (["--object", "none.glb"], "none.glb: no such file"),
    ],
)
def test_bad_input_is_refused_and_nothing_is_written(arlight, tmp_path, arguments, message):
    (tmp_path / "map.hdr").write_text("not a map")
    done = arlight("demo", *arguments)
    assert done.status == 1
    assert message in done.errors
    assert [path.name for path in tmp_path.iterdir()] == ["map.hdr"]
    assert (tmp_path / "map.hdr").read_text() == "not a map"
