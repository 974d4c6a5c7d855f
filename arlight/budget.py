"""Holds a deadline: moves along a ladder of efforts by the time that frames took.

A ladder lists points of the measured front of cost against error, the best first, each with what it costs relative to
the first. Times of late frames, divided by the costs of their rungs, say how fast the machine is now, and what single
frames took beyond that how often it is interrupted. The rung is the best one that nearly all frames would have made in
time. When even the cheapest is too slow, frames are left out.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.effort import Effort

_REMEMBERED = 90
"""Frames whose times count."""
_IN_TIME = 0.97
"""Share of them that a rung is to make in time."""
_ROOM = 0.85
"""Share of the budget that a better rung may take before it is tried."""
_LOOK_EVERY = 30
"""Frames after a change before a better rung is tried."""
_MOST_OWED = 4.0
"""Budgets that late frames may owe: frames are left out for slowness that lasts, not for a single hitch."""
_LONGEST_DOUBT = 16
"""How many times as long a rung is left alone, at most, that was tried in vain."""


@dataclass(frozen=True, slots=True)
class Rung:
    """A point of the front."""

    effort: Effort
    """The settings."""
    estimate_cost: float
    """What tracking and estimating cost, relative to the ladder's first rung."""
    draw_cost: float
    """What drawing costs, relative to the ladder's first rung."""


class BudgetController:
    """Chooses the effort of every frame.

    Args:
        budget_s: time that a frame may take from decoded to composed [s].
        ladder: rungs, the best and most expensive first.
    """

    def __init__(self, budget_s: float, ladder: Sequence[Rung]) -> None:
        if not budget_s > 0.0 or not ladder:
            raise ValueError(f"a budget needs a positive time and at least one rung, found {budget_s} s, {len(ladder)}")
        self.budget_s = budget_s
        self.ladder = tuple(ladder)
        self._costs = np.array([[rung.estimate_cost, rung.draw_cost] for rung in ladder])
        self._speeds: deque[NDArray[np.float64]] = deque(maxlen=_REMEMBERED)
        self._places: deque[int] = deque(maxlen=_REMEMBERED)
        self._place = 0
        self._wait = _LOOK_EVERY
        self._doubt = np.ones(len(ladder), int)
        self._owed = 0.0
        self.frames_at = np.zeros(len(ladder), int)
        """How many frames each rung has made."""
        self.late = 0
        """Frames that took longer than the budget."""
        self.left_out = 0
        """Frames that were not worked on."""

    @property
    def effort(self) -> Effort:
        """What the next frame may cost."""
        return self.ladder[self._place].effort

    def leaves_out(self) -> bool:
        """Whether the next frame is to be left out; ask once a frame."""
        if self._owed < self.budget_s:
            return False
        self._owed -= self.budget_s
        self.left_out += 1
        return True

    def took(self, effort: Effort, estimate_s: float, draw_s: float) -> None:
        """Learn what a frame took [s] at an effort, which need not be the present one: stages overlap."""
        total = estimate_s + draw_s
        place = next(i for i, rung in enumerate(self.ladder) if rung.effort == effort)
        self.frames_at[place] += 1
        self.late += total > self.budget_s
        if self.frames_at.sum() == 1:
            # acquires the sheet and waits for the object: tells nothing about the others
            return
        self._speeds.append(np.array([estimate_s, draw_s]) / self._costs[place])
        self._places.append(place)
        cheapest = self._place == len(self.ladder) - 1
        owed = min(max(self._owed + total - self.budget_s, 0.0), _MOST_OWED * self.budget_s)
        self._owed = owed if cheapest else 0.0
        self._wait -= 1
        expected = self._expected()
        if expected[self._place] > self.budget_s and not cheapest:
            self._fall()
        elif self._wait <= 0:
            self._rise(expected)

    def _expected(self) -> NDArray[np.float64]:
        """(rungs,) time that nearly all frames would stay within, were interruptions to cost any rung the same [s]."""
        speeds = np.array(self._speeds)
        usual = self._costs @ np.median(speeds, axis=0)
        beyond = np.sum(speeds * self._costs[self._places], axis=1) - usual[self._places]
        return np.asarray(usual + np.quantile(beyond, _IN_TIME), float)

    def _fall(self) -> None:
        """To the best rung that fits if the slowness lasts, and costs any rung its share."""
        self._doubt[self._place] = min(2 * self._doubt[self._place], _LONGEST_DOUBT)
        slow = np.quantile(np.array(self._speeds) @ self._costs.T, _IN_TIME, axis=0)
        cheaper = np.arange(len(slow)) > self._place
        fits = np.flatnonzero(cheaper & (slow <= self.budget_s))
        self._move(int(fits[0]) if len(fits) else len(slow) - 1)

    def _rise(self, expected: NDArray[np.float64]) -> None:
        if self._place == 0 or expected[self._place - 1] > _ROOM * self.budget_s:
            return
        if self._wait + _LOOK_EVERY * (self._doubt[self._place - 1] - 1) <= 0:
            self._move(self._place - 1)

    def _move(self, place: int) -> None:
        self._place, self._wait = place, _LOOK_EVERY
