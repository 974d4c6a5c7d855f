"""Running totals of a run."""

import math
from dataclasses import replace

import numpy as np
import pytest

from arlight.results.record import LogRecord
from arlight.results.statistics import RunStatistics


def record_of(frame: int, status: str = "tracked", ms: float = 2.0, chi2: float = 1.0) -> LogRecord:
    return LogRecord(frame, frame / 30, status, None, math.nan, None, None, None, chi2, {"track": ms})


def test_nothing_yet():
    statistics = RunStatistics()
    assert statistics.frames == statistics.tracked == 0
    assert statistics.tracked_share == statistics.frames_per_second == 0.0
    assert statistics.median_ms == {}
    assert math.isnan(statistics.median_chi2)


def test_frames_are_counted_by_status():
    statistics = RunStatistics()
    for frame, status in enumerate(["tracked", "tracked", "coasting", "lost", "tracked"]):
        statistics.add(record_of(frame, status))
    assert statistics.frames == 5
    assert statistics.tracked == 3
    assert statistics.tracked_share == pytest.approx(0.6)
    assert statistics.statuses == {"tracked": 3, "coasting": 1, "lost": 1}
    assert statistics.frames_per_second > 0.0


def test_medians_are_of_what_was_measured():
    statistics = RunStatistics()
    for frame, ms in enumerate([1.0, 9.0, 3.0]):
        statistics.add(record_of(frame, ms=ms, chi2=ms))
    statistics.add(record_of(3, ms=3.0, chi2=math.nan))
    statistics.add(record_of(4, "coasting", ms=3.0, chi2=500.0))
    assert statistics.median_ms == {"track": 3.0}
    assert statistics.median_chi2 == 3.0


def test_the_time_from_frame_to_frame_is_told_by_its_quantiles():
    statistics = RunStatistics()
    assert math.isnan(statistics.wall_quantile_ms(0.5))
    for wall_ms in [math.nan, 15.0, 17.0, 16.0, 40.0]:
        statistics.add(replace(record_of(0), wall_ms=wall_ms))
    assert statistics.wall_quantile_ms(0.5) == pytest.approx(16.5)
    assert statistics.wall_quantile_ms(1.0) == 40.0


def test_medians_of_a_long_run_are_those_of_all_of_it_and_take_no_more_room():
    statistics = RunStatistics()
    rng = np.random.default_rng(2)
    # slower and slower: a sample of the beginning or of the end would be off
    values = np.linspace(1.0, 3.0, 20_000) * rng.lognormal(0.0, 0.1, 20_000)
    for frame, ms in enumerate(values):
        statistics.add(record_of(frame, ms=float(ms)))
    assert len(statistics.stages_ms["track"].items) < 2000
    assert statistics.median_ms["track"] == pytest.approx(np.median(values), rel=0.02)
