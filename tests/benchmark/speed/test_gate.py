"""When a run counts as worse than its baseline, on made-up findings."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.gate import SLOWER, WORSE, BaselineError, failures, judge
from arlight.benchmark.speed.spread import Spread

NAMES = st.text("abc, ", min_size=1, max_size=6)
POSITIVE = st.floats(1e-6, 1e6)


def names(failed):
    return [failure.name for failure in failed]


def never(_names):
    raise AssertionError("nothing was to be measured again")


@given(st.dictionaries(NAMES, POSITIVE, min_size=1), st.dictionaries(NAMES, POSITIVE), st.floats(0.1, 1.0))
def test_what_is_as_good_or_better_passes(ratios, errors, factor):
    def made(scale):
        kept = {name: Ratio(Spread(scale * v, v, v, scale * v, 9), "yardstick", 1.0) for name, v in ratios.items()}
        return Findings(kept, {name: scale * value for name, value in errors.items()})

    assert failures(made(factor), made(1.0)) == []


def test_a_stage_slower_than_allowed_fails_and_one_within_passes(findings):
    baseline = findings({"track": 0.1, "render": 0.2})
    found = findings({"track": 0.1 * SLOWER * 1.01, "render": 0.2 * SLOWER * 0.99})
    (failure,) = failures(found, baseline)
    assert failure.name == "track"
    assert failure.factor == pytest.approx(1.01 * SLOWER)
    assert failure.scatter is not None
    assert failure.scatter[0] < failure.found < failure.scatter[1]


def test_a_median_that_may_be_above_by_chance_passes(findings):
    def made(least):
        return Findings({"loop": Ratio(Spread(2.0, 1.0, 3.0, least, 3), "a yardstick", 5.0)})

    baseline = findings({"loop": 1.0})
    assert failures(made(least=0.99 * SLOWER), baseline) == []
    assert names(failures(made(least=1.01 * SLOWER), baseline)) == ["loop"]


def test_an_error_worse_than_allowed_fails_and_one_within_passes(findings):
    baseline = findings(errors={"pose": 0.01, "light": 0.03})
    found = findings(errors={"pose": 0.01 * WORSE * 0.99, "light": 0.03 * WORSE * 1.01})
    assert names(failures(found, baseline)) == ["light"]


def test_milliseconds_do_not_matter(findings):
    found, baseline = findings({"track": 0.1}), findings({"track": 0.1})
    found.ratios["track"] = Ratio(found.ratios["track"].value, "a yardstick", 1e6)
    assert failures(found, baseline) == []


@pytest.mark.parametrize("lost", [inf, nan])
def test_what_can_no_longer_be_told_fails(findings, lost):
    assert names(failures(findings({"track": lost}, {"pose": lost}), findings({"track": 0.1}, {"pose": 0.1}))) != []
    assert len(failures(findings({"track": lost}, {"pose": lost}), findings({"track": 0.1}, {"pose": 0.1}))) == 2


def test_what_could_not_be_told_before_does_not_fail(findings):
    assert failures(findings(errors={"pose": 5.0}), findings(errors={"pose": nan})) == []


def test_only_what_both_measured_is_compared(findings):
    baseline = findings({"track": 0.1, "growth": 0.1}, {"pose": 1.0})
    assert failures(findings({"track": 0.1, "new": 99.0}, {"new error": 99.0}), baseline) == []


def test_a_baseline_of_something_else_is_refused(findings):
    with pytest.raises(BaselineError, match="--json"):
        failures(findings({"track": 0.1}), findings({"other": 0.1}))


def test_the_worst_comes_first(findings):
    found = findings({"a": 1.4, "b": 2.0}, {"c": 5.0})
    assert names(failures(found, findings({"a": 1.0, "b": 1.0}, {"c": 1.0}))) == ["c", "b", "a"]


def test_nothing_is_measured_again_without_need(findings):
    assert judge(findings({"track": 0.1}), findings({"track": 0.1}), never) == []


def test_a_disturbance_that_does_not_come_again_passes(findings):
    asked = []

    def again(suspected):
        asked.append(suspected)
        return findings({"track": 0.11, "render": 0.9}, {"pose": 0.01})

    found = findings({"track": 0.5, "render": 0.2}, {"pose": 0.01})
    assert judge(found, findings({"track": 0.1, "render": 0.2}, {"pose": 0.01}), again) == []
    assert asked == [{"track"}]
    assert found.ratios["track"].value.median == 0.11
    # what passed at once keeps its first measurement
    assert found.ratios["render"].value.median == 0.2


@pytest.mark.parametrize("second", [0.5, 0.9])
def test_what_is_worse_twice_fails_with_the_better_of_both(findings, second):
    found, baseline = findings({"track": 0.6}, {"pose": 2.0}), findings({"track": 0.1}, {"pose": 1.0})
    failed = judge(found, baseline, lambda _names: findings({"track": second}, {"pose": 1.5}))
    assert {failure.name: failure.found for failure in failed} == {"track": min(0.6, second), "pose": 1.5}


def test_an_error_that_is_lost_at_first_and_found_again_passes(findings):
    found = findings(errors={"pose": nan})
    assert judge(found, findings(errors={"pose": 1.0}), lambda _names: findings(errors={"pose": 1.05})) == []
