"""The closing summary."""

from pathlib import Path

from arlight.commands.summary import print_summary
from arlight.results.record import LogRecord
from arlight.results.statistics import RunStatistics


def test_the_summary_says_what_was_done_and_where_it_is(capsys):
    statistics = RunStatistics()
    for frame, status in enumerate(["tracked", "tracked", "tracked", "lost"]):
        statistics.add(LogRecord(frame, 0.0, status, None, 0.0, None, None, None, 1.0, {"track": 1.25, "render": 8.0}))
    print_summary(statistics, {"output": Path("a [b].mp4")}, interrupted=True)
    text = capsys.readouterr().out
    assert "4 (interrupted)" in text
    assert "75.0 % tracked (3 tracked, 1 lost)" in text
    assert "track 1.2, render 8.0" in text
    assert "a [b].mp4" in text


def test_a_run_without_a_frame_has_a_summary(capsys):
    print_summary(RunStatistics(), {}, interrupted=False)
    assert "0.0 % tracked" in capsys.readouterr().out
