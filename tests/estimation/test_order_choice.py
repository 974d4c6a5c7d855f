"""The order that a scene requires, on made-up light: known parts, known uncertainty."""

import numpy as np
import pytest

from arlight.estimation.lighting import Lighting
from arlight.estimation.order_choice import Need, OrderChoice
from arlight.fourier import frequency_order, half_plane_frequencies, unpack_real

FREQUENCIES = half_plane_frequencies(4)
ORDERS = frequency_order(FREQUENCIES)
PACKED_ORDERS = np.concatenate([ORDERS[:1], np.repeat(ORDERS[1:], 2)])


def lighting(amplitude: list[float], stddev: float, seed: int = 0, order: int = 4) -> Lighting:
    """Light of amplitudes by order relative to its level, seen with errors of a standard deviation."""
    chance = np.random.default_rng(seed)
    sign = np.where(np.arange(len(PACKED_ORDERS)) % 2 == 0, 1.0, -1.0)
    packed = np.array(amplitude)[PACKED_ORDERS] * sign
    packed[0] = 1.0
    seen = packed[:, None] + stddev * chance.standard_normal((len(packed), 3))
    # error bars allow for more than a picture shows
    covariance = np.tile(stddev**2 / 0.15 * np.eye(len(packed)), (3, 1, 1))
    return Lighting(FREQUENCIES, unpack_real(seen), covariance, 0.0, 1.0).truncated(order)


def need(shown: list[float], tolerance: float = 0.04) -> Need:
    """An object that shows the orders so much; coefficients are independent."""
    return Need(np.eye(len(PACKED_ORDERS)), np.array(shown)[PACKED_ORDERS], tolerance)


def settled(
    choice: OrderChoice, amplitude: list[float], stddev: float, frames: int = 60, start_s: float = 0.0
) -> list[int]:
    """Orders measured in frames of a twenty-fifth of a second."""
    measured = []
    for frame in range(frames):
        time_s = start_s + frame / 25.0
        order = choice.order_to_measure(time_s)
        measured.append(order)
        seen = lighting(amplitude, stddev, frame, order)
        choice.learn(seen, lighting(amplitude, stddev / 5.0, frame + 1000, min(order, choice.order)), time_s)
    return measured


def test_it_begins_with_all_orders() -> None:
    assert OrderChoice(FREQUENCIES, need([1.0] * 5)).order_to_measure(0.0) == 4


def test_an_object_that_shows_low_orders_alone_needs_no_more() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0, 1.0, 0.5, 1e-9, 1e-10]))
    measured = settled(choice, [1.0, 0.3, 0.2, 0.2, 0.2], 0.01, 125)
    assert choice.order == 2
    # all orders are looked at again about once a second
    assert 3 <= measured[25:].count(4) <= 5


def test_an_object_that_shows_all_orders_gets_them() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0] * 5))
    settled(choice, [1.0, 0.3, 0.2, 0.2, 0.2], 0.01)
    assert choice.order == 4


def test_light_without_high_orders_is_not_measured_there() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0] * 5))
    settled(choice, [1.0, 0.3, 0.0, 0.0, 0.0], 0.01)
    assert choice.order == 1


def test_what_noise_drowns_is_left_out_even_where_nothing_may_be_lost() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0] * 5, tolerance=0.0))
    settled(choice, [1.0, 0.3, 0.2, 0.0, 0.0], 0.2)
    assert choice.order == 2


def test_light_that_gets_richer_is_followed_within_a_second_and_light_that_gets_poorer_too() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0] * 5))
    settled(choice, [1.0, 0.3, 0.0, 0.0, 0.0], 0.01)
    settled(choice, [1.0, 0.3, 0.2, 0.2, 0.2], 0.01, 30, 100.0)
    assert choice.order == 4
    settled(choice, [1.0, 0.3, 0.0, 0.0, 0.0], 0.01, 60, 200.0)
    assert choice.order == 1


def test_a_switch_of_the_low_orders_is_reason_to_look_at_all_at_once() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0] * 5))
    settled(choice, [1.0, 0.3, 0.0, 0.0, 0.0], 0.01, 40)
    changed = settled(choice, [1.0, 0.7, 0.3, 0.3, 0.3], 0.01, 7, 1.61)
    assert 4 in changed[1:6]
    assert choice.order == 4


def test_orders_at_the_edge_of_being_needed_do_not_flicker() -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0, 1.0, 1.0, 0.012, 0.0]))
    chosen = []
    for frame in range(250):
        time_s = frame / 25.0
        order = choice.order_to_measure(time_s)
        seen = lighting([1.0, 0.3, 0.2, 0.03, 0.0], 0.01, frame, order)
        filtered = lighting([1.0, 0.3, 0.2, 0.03, 0.0], 0.002, frame + 1000, min(order, choice.order))
        choice.learn(seen, filtered, time_s)
        chosen.append(choice.order)
    changes = np.count_nonzero(np.diff(chosen))
    assert changes <= 4


@pytest.mark.parametrize("level", [0.0, 1e-9])
def test_darkness_asks_for_nothing_impossible(level: float) -> None:
    choice = OrderChoice(FREQUENCIES, need([1.0] * 5))
    dark = lighting([1.0, 0.3, 0.2, 0.2, 0.2], 0.01)
    dark = dark.scaled(np.full(3, level))
    choice.learn(dark, dark, 0.0)
    assert 0 <= choice.order <= 4
