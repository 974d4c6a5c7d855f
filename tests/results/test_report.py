"""The report: one page, nothing outside it, the light where it comes from."""

import math
import re

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.fourier import analyse, half_plane_frequencies
from arlight.optics import Slab
from arlight.results.record import LogHeader, LogRecord
from arlight.results.report import ReportRecorder, light_disk
from arlight.results.statistics import RunStatistics
from arlight.video.frame import Frame

FREQUENCIES = half_plane_frequencies(2)


@pytest.fixture
def recorder() -> ReportRecorder:
    camera = Camera((64, 48), [[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]], np.zeros(5))
    return ReportRecorder(LogHeader(FREQUENCIES, camera, Slab(), (120.0, 90.0), "a <clip>.mp4", "probe.json"))


def record_of(frame: int, known: bool = True) -> LogRecord:
    light = analyse(np.ones((1, 3)), np.array([[0.2, 0.1]]), FREQUENCIES) if known else None
    spread = np.full((len(FREQUENCIES), 3), 0.01) if known else None
    pose = Pose(np.eye(3), np.array([0.0, 0.0, 300.0])) if known else None
    status = "tracked" if known else "lost"
    return LogRecord(frame, frame / 30, status, pose, 0.1, light, spread, 2 if known else None, 1.0, {"track": 2.0})


def page_of(recorder, tmp_path, frames, known=lambda _frame: True) -> str:
    statistics = RunStatistics()
    picture = Frame.from_rgb(np.full((48, 64, 3), 128, np.uint8))
    for frame in range(frames):
        record = record_of(frame, known(frame))
        recorder.add(record, picture)
        statistics.add(record)
    path = tmp_path / "report.html"
    recorder.write(path, statistics)
    return path.read_text()


@pytest.mark.parametrize("frames", [1, 2, 12, 23, 24, 25, 100, 501])
def test_a_dozen_pictures_at_most_spread_over_the_clip(recorder, tmp_path, frames):
    page = page_of(recorder, tmp_path, frames)
    shown = [int(n) for n in re.findall(r"<figcaption>frame (\d+),", page)]
    assert len(shown) == page.count('class="disk"')
    assert min(frames, 6) <= len(shown) <= 12
    assert shown[0] == 0
    gaps = np.diff(shown)
    assert len(set(gaps)) <= 1
    # the last one is less than a gap from the end
    assert frames - 1 - shown[-1] < (gaps[0] if len(gaps) else 1)


def test_nothing_outside_the_page_is_needed(recorder, tmp_path):
    page = page_of(recorder, tmp_path, 5)
    assert page.count("<svg") == 1
    assert "<script" not in page
    targets = re.findall(r'(?:src|xlink:href|href)="([^"]*)"', page)
    assert targets
    assert all(target.startswith(("data:", "#")) for target in targets)


def test_names_are_escaped(recorder, tmp_path):
    page = page_of(recorder, tmp_path, 2)
    assert "a &lt;clip&gt;.mp4" in page
    assert "<clip>" not in page


def test_frames_without_an_estimate_have_no_disk(recorder, tmp_path):
    page = page_of(recorder, tmp_path, 6, known=lambda frame: frame >= 3)
    assert page.count('class="frame"') == 6
    assert page.count('class="disk"') == 3
    assert "frame 0, 0.00 s, lost" in page


def test_a_run_that_never_saw_the_sheet_has_a_page(recorder, tmp_path):
    page = page_of(recorder, tmp_path, 3, known=lambda _frame: False)
    assert 'class="disk"' not in page
    assert "0.0 % tracked" in page


@pytest.mark.parametrize("point", [(0.3, 0.0), (0.0, 0.3), (-0.2, -0.2)])
def test_the_disk_is_bright_where_the_lamp_is(point):
    frequencies = half_plane_frequencies(5)
    light = analyse(np.ones((1, 3)), np.array([point]), frequencies)
    disk = light_disk(light, frequencies, 101)
    row, column = np.unravel_index(np.nanargmax(disk[..., 0]), disk.shape[:2])
    # row 0 is the sheet's upper edge
    assert ((column + 0.5) / 101 - 0.5, 0.5 - (row + 0.5) / 101) == pytest.approx(point, abs=0.5 / 101)


def test_the_disk_ends_at_the_horizon():
    disk = light_disk(np.ones((1, 3), complex), half_plane_frequencies(0), 200)
    assert np.isfinite(disk[..., 0]).mean() == pytest.approx(math.pi / 4, abs=0.01)
    np.testing.assert_allclose(disk[np.isfinite(disk)], 1.0)
