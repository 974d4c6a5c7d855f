"""What one part of the benchmark found: ratios to yardsticks, errors, and everything worth telling beside them."""

from dataclasses import dataclass, field
from typing import Any

from arlight.benchmark.speed.spread import Spread


@dataclass(frozen=True, slots=True)
class Ratio:
    """What something costs relative to something else that was measured in turns with it."""

    value: Spread
    """Paired ratios."""
    over: str
    """The yardstick, in words."""
    cost_ms: float
    """Median cost on this machine, of which the ratio is taken [ms]; wall time of a whole run, else CPU a frame."""


@dataclass(slots=True)
class Findings:
    """Findings by name. Names are "what, workload" and stay the same from run to run."""

    ratios: dict[str, Ratio] = field(default_factory=dict)
    """Costs over yardsticks; lower is better."""
    errors: dict[str, float] = field(default_factory=dict)
    """Errors on frames whose truth is known; lower is better."""
    details: dict[str, Any] = field(default_factory=dict)
    """Plain numbers, texts, lists and dicts for the JSON file, by section."""
    notes: list[str] = field(default_factory=list)
    """What could not be measured and why."""

    def merge(self, other: "Findings") -> None:
        """Take in another part's findings; lists of one section are joined, dicts united."""
        self.ratios.update(other.ratios)
        self.errors.update(other.errors)
        self.notes.extend(note for note in other.notes if note not in self.notes)
        for section, found in other.details.items():
            before = self.details.get(section)
            if isinstance(before, list):
                self.details[section] = before + found
            elif isinstance(before, dict):
                self.details[section] = before | found
            else:
                self.details[section] = found
