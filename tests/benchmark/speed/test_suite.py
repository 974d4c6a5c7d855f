"""The parts as a whole: their names, what is measured again, what is left out."""

import pytest

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.suite import Part, Suite
from arlight.errors import RenderingUnavailableError


class CountedSuite(Suite):
    """A suite of parts that are told."""

    def parts(self):
        return PARTS


PARTS: list[Part] = []


@pytest.fixture
def suite(tmp_path, monkeypatch):
    monkeypatch.setattr("arlight.benchmark.speed.suite.film", lambda *_arguments: None)

    def make(*parts):
        PARTS[:] = parts
        return CountedSuite(tmp_path, tmp_path, quick=True)

    return make


@pytest.mark.parametrize("quick", [True, False])
def test_parts_and_workloads_have_names_of_their_own(tmp_path, quick):
    suite = Suite(tmp_path, tmp_path, quick)
    names = [part.name for part in suite.parts()]
    assert len(set(names)) == len(names)
    workloads = [workload.name for workload in suite.workloads]
    assert len(set(workloads)) == len(workloads)
    assert suite.steps == len(names) + len(workloads)


def test_only_what_found_a_suspect_is_measured_again(suite, findings):
    calls = []

    def part(name, found):
        return Part(name, lambda: calls.append(name) or found())

    made = suite(
        part("tracking", lambda: findings({"track": 1.0}, {"pose": 2.0})),
        part("drawing", lambda: findings({"render": 1.0})),
    )
    found = made.run(lambda _name: None)
    assert set(found.ratios) == {"track", "render"}
    again = made.again({"pose"}, lambda _name: None)
    assert calls == ["tracking", "drawing", "tracking"]
    assert set(again.ratios) == {"track"}


def test_what_needs_opengl_is_left_out_without_it_and_the_rest_is_measured(suite, findings):
    def without():
        raise RenderingUnavailableError("no headless OpenGL")

    made = suite(Part("drawing", without), Part("tracking", lambda: findings({"track": 1.0})))
    told = []
    found = made.run(told.append)
    assert set(found.ratios) == {"track"}
    assert found.notes == ["drawing was left out: no headless OpenGL"]
    assert told == ["drawing", "tracking"]


def test_findings_of_all_parts_come_together():
    together = Findings(details={"loop": [1], "growth": {"order": [1]}})
    together.merge(Findings(details={"loop": [2], "growth": {"faces": [2]}, "bound": {"a": 1}}, notes=["once"]))
    together.merge(Findings(notes=["once"]))
    assert together.details == {"loop": [1, 2], "growth": {"order": [1], "faces": [2]}, "bound": {"a": 1}}
    assert together.notes == ["once"]
