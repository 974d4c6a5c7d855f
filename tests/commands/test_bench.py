"""`arlight bench`: outputs, the gate's verdict and what is refused, with made-up measurements."""

import json

import pytest

from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.spread import Spread
from arlight.benchmark.speed.suite import Suite
from arlight.benchmark.speed.workloads import HEADLINE
from arlight.errors import RenderingUnavailableError


def point(name, cost, error, is_preset):
    return {
        "name": name,
        "is_preset": is_preset,
        "cost_ms": {"median": cost, "low": cost, "high": cost, "count": 3},
        "stages_ms": {"track": cost / 2, "relight": cost / 2},
        "estimate_over_aruco": {"median": 0.1, "low": 0.1, "high": 0.1, "count": 3},
        "estimate_ms": cost / 2,
        "relight_ms": cost / 2,
        "relighting_error": error,
        "coefficient_error": error,
        "error_by_order": (error, error),
        "on_front": True,
    }


def made_up(cost=0.1, error=0.01):
    ratio = Ratio(Spread(cost, 0.9 * cost, 1.1 * cost, cost, 9), "ArUco + solvePnP", 2.0)
    found = Findings({f"track to filter, {HEADLINE}": ratio}, {"pose": error})
    found.details["front"] = [point("fast", 1.0, 0.05, True), point("order 3", 2.0, 0.03, False)]
    found.details["growth"] = {"order": [{"value": v, "estimate_ms": v, "relight_ms": 1.0} for v in (1, 2, 3)]}
    return found


@pytest.fixture
def measured(monkeypatch):
    """Replaces the measurements: first those of the run, then those that are made again."""

    def replace_by(first, second=None):
        def run(_suite, watch):
            watch("tracking")
            if isinstance(first, BaseException):
                raise first
            return first

        monkeypatch.setattr(Suite, "run", run)
        monkeypatch.setattr(Suite, "again", lambda _suite, _names, _watch: second or first)

    return replace_by


@pytest.fixture
def baseline(arlight, measured):
    measured(made_up())
    assert arlight("bench", "--json", "baseline.json").status == 0
    return "baseline.json"


def test_numbers_and_picture_are_written(arlight, measured, tmp_path):
    measured(made_up())
    done = arlight("bench", "--quick", "--json", "found.json", "--plot", "front.svg")
    assert done.status == 0, done.errors
    assert json.loads((tmp_path / "found.json").read_text())["estimate_over_aruco"] == 0.1
    page = (tmp_path / "front.svg").read_text()
    assert "<svg" in page
    assert "found.json" in done.output
    assert "front.svg" in done.output


def test_an_unchanged_run_passes_the_gate(arlight, baseline):
    done = arlight("bench", "--gate", baseline)
    assert done.status == 0, done.errors
    assert "nothing is worse" in done.output


@pytest.mark.parametrize(("change", "name"), [({"cost": 0.14}, "track to filter"), ({"error": 0.0112}, "pose")])
def test_what_is_worse_twice_fails_by_name(arlight, measured, baseline, change, name):
    measured(made_up(**change))
    done = arlight("bench", "--gate", baseline)
    assert done.status == 1
    verdict = done.output.split("worse than the baseline allows")[1]
    assert name in verdict


def test_what_is_worse_once_passes(arlight, measured, baseline):
    measured(made_up(cost=0.5), made_up(cost=0.11))
    assert arlight("bench", "--gate", baseline).status == 0


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--plot", "front.txt"], "--plot must end in"),
        (["--json", "nowhere/found.json"], "no such folder"),
        (["--gate", "none.json"], "none.json"),
        (["--length", "0"], "--length"),
        (["--json", "same.svg", "--plot", "same.svg"], "same file"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_measured(arlight, measured, arguments, complaint):
    measured(AssertionError("measured nevertheless"))
    done = arlight("bench", *arguments)
    assert done.status == 1
    assert complaint in done.errors


def test_the_baseline_is_not_overwritten(arlight, baseline, tmp_path):
    before = (tmp_path / baseline).read_text()
    done = arlight("bench", "--gate", baseline, "--json", baseline)
    assert done.status == 1
    assert (tmp_path / baseline).read_text() == before


@pytest.mark.parametrize(("error", "status"), [(RenderingUnavailableError("no OpenGL"), 1), (KeyboardInterrupt(), 130)])
def test_a_run_that_ends_early_leaves_nothing(arlight, measured, error, status, tmp_path):
    measured(error)
    done = arlight("bench", "--json", "found.json", "--plot", "front.png", "--frames", "frames")
    assert done.status == status
    assert [path.name for path in tmp_path.iterdir()] == ["frames"]
    assert list((tmp_path / "frames").iterdir()) == []
