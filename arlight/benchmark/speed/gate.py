"""Whether a run of the benchmark is worse than an earlier one, by ratios to yardsticks and by errors, not by times."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

from arlight.benchmark.speed.findings import Findings
from arlight.errors import ArlightError

SLOWER = 1.3
"""Factor on a stage's cost relative to its yardstick from which it counts as slower, where that is no chance."""
WORSE = 1.1
"""Factor on an error from which it counts as worse."""


class BaselineError(ArlightError):
    """A baseline that cannot be compared with."""


@dataclass(frozen=True, slots=True)
class Failure:
    """Something that is worse than it was."""

    name: str
    """What was measured, on what."""
    before: float
    """Value in the baseline."""
    found: float
    """Value now; the better one where it was measured twice."""
    allowed: float
    """Factor that was allowed."""
    scatter: tuple[float, float] | None = None
    """10 and 90 % of the paired ratios that the value is the median of; None for errors."""

    @property
    def factor(self) -> float:
        """How many times worse it is."""
        return self.found / self.before if self.before > 0.0 else float("inf")


def failures(found: Findings, baseline: Findings) -> list[Failure]:
    """What is worse than allowed, of what was measured both times; the worst first.

    Raises:
        BaselineError: nothing was measured both times.
    """
    ratios, errors = found.ratios.keys() & baseline.ratios.keys(), found.errors.keys() & baseline.errors.keys()
    if not ratios and not errors:
        raise BaselineError("the baseline has no measurement that this run made; make it anew with --json")
    failed = []
    for name in ratios:
        now, before = found.ratios[name].value, baseline.ratios[name].value.median
        # a median that is above by chance is no reason; nan is
        if not now.least <= SLOWER * before:
            failed.append(Failure(name, before, now.median, SLOWER, (now.low, now.high)))
    for name in errors:
        error, before = found.errors[name], baseline.errors[name]
        # what could not be told before cannot have become worse
        if isfinite(before) and not error <= WORSE * before:
            failed.append(Failure(name, before, error, WORSE))
    return sorted(failed, key=lambda failure: -failure.factor / failure.allowed)


def judge(found: Findings, baseline: Findings, again: Callable[[set[str]], Findings]) -> list[Failure]:
    """What is still worse than allowed when it is measured once more.

    Args:
        found: of this run; takes in the better value of what is measured again.
        baseline: of an earlier run.
        again: measures anew what goes by these names.

    Raises:
        BaselineError: nothing was measured both times.
    """
    suspected = {failure.name for failure in failures(found, baseline)}
    if not suspected:
        return []
    second = again(suspected)
    for name in suspected & second.ratios.keys():
        found.ratios[name] = min(found.ratios[name], second.ratios[name], key=lambda ratio: ratio.value.least)
    for name in suspected & second.errors.keys():
        found.errors[name] = min((found.errors[name], second.errors[name]), key=lambda e: e if isfinite(e) else 1e300)
    return failures(found, baseline)
