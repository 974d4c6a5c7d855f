"""Holding a deadline on made-up machines: their frames take what their speed, the rung and chance make of it."""

import numpy as np
import pytest

from arlight.budget import BudgetController, Rung
from arlight.effort import Effort

LADDER = [
    Rung(Effort(order, 1200), estimate_cost, draw_cost)
    for order, estimate_cost, draw_cost in [(5, 1.0, 1.0), (4, 0.8, 0.9), (3, 0.5, 0.6), (2, 0.3, 0.5), (1, 0.15, 0.4)]
]


def played(budget_s: float, frame_s: float, frames: int = 600, seed: int = 0, noise: float = 0.05) -> BudgetController:
    """A controller after a run on a machine where the best rung takes `frame_s`, a third of it for the estimate."""
    chance = np.random.default_rng(seed)
    controller = BudgetController(budget_s, LADDER)
    for _ in range(frames):
        if controller.leaves_out():
            continue
        rung = next(rung for rung in LADDER if rung.effort == controller.effort)
        slowness = frame_s * (1.0 + noise * chance.exponential())
        controller.took(rung.effort, slowness * rung.estimate_cost / 3.0, slowness * rung.draw_cost * 2.0 / 3.0)
    return controller


@pytest.mark.parametrize("budget_s", [0.033, 0.016, 0.010])
@pytest.mark.parametrize("frame_s", [0.002, 0.009, 0.015, 0.020])
def test_nearly_all_frames_are_in_time_where_the_cheapest_rung_is(budget_s: float, frame_s: float) -> None:
    controller = played(budget_s, frame_s)
    assert controller.left_out == 0
    assert controller.late <= 0.05 * controller.frames_at.sum()


def test_a_fast_machine_gives_up_nothing() -> None:
    assert played(0.016, 0.006).effort == LADDER[0].effort


def test_the_smaller_the_budget_the_less_effort() -> None:
    orders = [played(budget_s, 0.02).effort.order for budget_s in (0.033, 0.022, 0.016, 0.012, 0.008)]
    assert orders == sorted(orders, reverse=True)
    assert orders[0] == 5
    assert orders[-1] < orders[0]


def test_frames_are_left_out_only_when_even_the_cheapest_rung_is_too_slow() -> None:
    controller = played(0.008, 0.05)
    assert controller.effort == LADDER[-1].effort
    # each frame of the cheapest rung takes about 2 budgets: about every second one is left out
    assert 0.35 < controller.left_out / 600 < 0.65


def test_a_machine_that_slows_down_is_followed_and_forgiven() -> None:
    controller = BudgetController(0.016, LADDER)
    places = []
    for frame in range(900):
        rung = next(rung for rung in LADDER if rung.effort == controller.effort)
        frame_s = 0.030 if 300 <= frame < 500 else 0.010
        controller.took(rung.effort, frame_s * rung.estimate_cost / 3.0, frame_s * rung.draw_cost * 2.0 / 3.0)
        places.append(LADDER.index(rung))
    assert places[299] == 0
    assert places[310] > 0
    assert places[-1] == 0
    # a few late frames are chance, more are a slower machine
    assert controller.late <= 6


def test_a_rung_that_is_tried_in_vain_is_tried_ever_less_often() -> None:
    """Its measured cost is wrong on this machine: it takes twice as long as the ladder says."""
    controller = BudgetController(0.016, LADDER)
    tries = []
    last = len(LADDER) - 1
    for frame in range(4000):
        place = next(i for i, rung in enumerate(LADDER) if rung.effort == controller.effort)
        if place == 0 and last != 0:
            tries.append(frame)
        last = place
        slow = 2.0 if place == 0 else 1.0
        rung = LADDER[place]
        controller.took(rung.effort, 0.012 * slow * rung.estimate_cost / 3.0, 0.012 * slow * rung.draw_cost * 2.0 / 3.0)
    gaps = np.diff(tries)
    assert len(tries) >= 2
    assert gaps[-1] > 2 * gaps[0]
    assert controller.late <= 0.05 * 4000


@pytest.mark.parametrize(("budget_s", "ladder"), [(0.0, LADDER), (-1.0, LADDER), (float("nan"), LADDER), (0.01, [])])
def test_budgets_that_mean_nothing_are_refused(budget_s: float, ladder: list[Rung]) -> None:
    with pytest.raises(ValueError, match="budget"):
        BudgetController(budget_s, ladder)
