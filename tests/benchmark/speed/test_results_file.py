"""Results as JSON and back as a baseline."""

import json
from math import inf, nan

import pytest

from arlight.benchmark.speed.gate import BaselineError, failures
from arlight.benchmark.speed.results_file import headline, load_baseline, results_text
from arlight.benchmark.speed.workloads import HEADLINE, LARGE

HEADLINES = [
    "estimate_over_aruco",
    "loop_over_transcode",
    "loop_fps_720p",
    "loop_fps_1080p",
    "first_result_s",
    "error_over_bound",
]


@pytest.fixture
def found(findings):
    made = findings({f"track to filter, {HEADLINE}": 0.12, f"loop, {HEADLINE}": 1.5}, {"pose": 0.01, "lost": inf})
    made.details["loop"] = [
        {"name": HEADLINE, "frames_per_second": 60.0},
        {"name": LARGE, "frames_per_second": 30.0},
    ]
    made.details["start"] = {"first_result_s": 1.25}
    made.details["bound"] = {"together": 1.1}
    return made


def test_the_figures_that_matter_stand_at_the_top_level(found):
    content = json.loads(results_text(found, quick=True))
    assert list(content)[2:8] == HEADLINES
    assert [content[name] for name in HEADLINES] == [0.12, 1.5, 60.0, 30.0, 1.25, 1.1]
    assert content["quick"] is True
    assert content["machine"]["cores"] >= 1


def test_what_was_not_measured_is_null(findings):
    content = json.loads(results_text(findings({"track": 1.0}), quick=False))
    assert all(content[name] is None for name in HEADLINES)
    assert all(value != value for value in headline(findings()).values())


def test_a_run_passes_when_compared_with_its_own_file(found, tmp_path):
    path = tmp_path / "baseline.json"
    path.write_text(results_text(found, quick=False))
    read = load_baseline(str(path))
    assert read.ratios.keys() == found.ratios.keys()
    assert read.errors["lost"] != read.errors["lost"]
    assert failures(found, read) == []


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"format": "arlight-lighting", "version": 1}',
        '{"format": "arlight-bench", "version": 99, "ratios": {}, "errors": {}}',
        '{"format": "arlight-bench", "version": 1, "ratios": {"track": 3}, "errors": {}}',
        '{"format": "arlight-bench", "version": 1, "ratios": {}, "errors": ["pose"]}',
        '{"format": "arlight-bench", "version": 1, "ratios": {}, "errors": {"pose": "small"}}',
    ],
)
def test_another_file_is_refused(text, tmp_path):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(BaselineError, match="--json"):
        load_baseline(str(path))


def test_a_file_that_is_not_there_and_one_that_is_no_text_are_refused(tmp_path):
    with pytest.raises(BaselineError, match="No such file"):
        load_baseline(str(tmp_path / "none.json"))
    with pytest.raises(BaselineError):
        load_baseline(str(tmp_path))
    binary = tmp_path / "binary.json"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BaselineError):
        load_baseline(str(binary))


def test_numbers_have_six_digits_and_none_is_not_finite(findings):
    made = findings({"track": 1.0 / 3.0})
    made.details["front"] = [{"cost": nan, "name": "order 3", "is_preset": True, "orders": (0.1, 2.0 / 3.0)}]
    content = json.loads(results_text(made, quick=False))
    assert content["ratios"]["track"]["value"]["median"] == 0.333333
    assert content["front"] == [{"cost": None, "name": "order 3", "is_preset": True, "orders": [0.1, 0.666667]}]
