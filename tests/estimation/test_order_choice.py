"""The order that a scene requires, on made-up light: known parts, known uncertainty."""

import numpy as np
import pytest

from arlight.estimation.lighting import Lighting
from arlight.estimation.order_choice import OrderChoice
from arlight.estimation.shown_light import Need
from arlight.fourier import frequency_order, half_plane_frequencies, unpack_real
from tests.estimation.conftest import Anywhere

FREQUENCIES = half_plane_frequencies(4)
ORDERS = frequency_order(FREQUENCIES)
PACKED_ORDERS = np.concatenate([ORDERS[:1], np.repeat(ORDERS[1:], 2)])


RICH = [1.0, 0.3, 0.3, 0.3, 0.3]
"""Amplitudes by order of light like a window's."""
SOFT = [1.0, 0.03, 0.03, 0.03, 0.03]
"""Light like that of an overcast sky."""
EVEN = [1.0, 1e-4, 1e-4, 1e-4, 1e-4]
"""Light of which nothing but the level can be measured."""


def lighting(amplitude: list[float], stddev: float, seed: int = 0, order: int = 4) -> Lighting:
    """Light of amplitudes by order relative to its level, seen with errors that grow with the order as a sheet's do.

    `stddev` is that of order 1; of the level it is four times less.
    """
    chance = np.random.default_rng(seed)
    sign = np.where(np.arange(len(PACKED_ORDERS)) % 2 == 0, 1.0, -1.0)
    packed = np.array(amplitude)[PACKED_ORDERS] * sign
    packed[0] = 1.0
    errors = stddev * np.array([0.25, 1.0, 4.0, 16.0, 64.0])[PACKED_ORDERS]
    seen = packed[:, None] + errors[:, None] * chance.standard_normal((len(packed), 3))
    # error bars allow for more than there is
    covariance = np.tile(4.0 * np.diag(errors**2), (3, 1, 1))
    return Lighting(FREQUENCIES, unpack_real(seen), covariance, 0.0, 1.0).truncated(order)


def need(shown: list[float], tolerance: float = 0.04) -> Need:
    """An object that shows the orders so much; coefficients are independent."""
    return Need(np.eye(len(PACKED_ORDERS)), np.diag(np.array(shown)[PACKED_ORDERS]), tolerance)


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
    assert OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5)).order_to_measure(0.0) == 4


def test_an_object_that_shows_low_orders_alone_needs_no_more() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0, 1.0, 0.5, 1e-9, 1e-10]))
    measured = settled(choice, RICH, 0.001, 125)
    assert choice.order == 2
    # all orders are looked at again every other second
    assert 1 <= measured[50:].count(4) <= 2


def test_an_object_that_shows_all_orders_gets_them() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, RICH, 0.003)
    assert choice.order == 4


def test_orders_that_light_has_in_common_count_together() -> None:
    """What two parts add to a picture they may take from it: only the whole form tells."""
    shown = need([1.0] * 5).shown.copy()
    shown[1:, 1:] = 1e-4 * np.eye(len(shown) - 1)
    beyond = np.flatnonzero(PACKED_ORDERS >= 3)
    sign = np.where(beyond % 2 == 0, 1.0, -1.0)
    together = OrderChoice(Anywhere(FREQUENCIES), Need(np.eye(len(shown)), _added(shown, beyond, sign), 0.04))
    against = OrderChoice(
        Anywhere(FREQUENCIES), Need(np.eye(len(shown)), _added(shown, beyond, np.ones(len(sign))), 0.04)
    )
    for choice in (together, against):
        settled(choice, RICH, 1e-4)
    assert together.order == 4
    assert against.order <= together.order


def _added(shown: np.ndarray, places: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """A form that also sees the parts at some places along one direction."""
    vector = np.zeros(len(shown))
    vector[places] = direction / np.sqrt(len(direction))
    return shown + np.outer(vector, vector)


def test_soft_light_is_not_measured_where_noise_drowns_it() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, SOFT, 0.02)
    assert 1 <= choice.order <= 3


def test_what_noise_drowns_is_left_out() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, RICH, 0.3)
    assert 1 <= choice.order <= 3


def test_light_that_gets_richer_is_followed_within_a_second_and_light_that_gets_poorer_too() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, SOFT, 0.02)
    assert choice.order < 4
    settled(choice, RICH, 0.02, 30, 100.0)
    assert choice.order == 4
    settled(choice, SOFT, 0.02, 100, 200.0)
    assert choice.order < 4


def test_a_switch_of_the_low_orders_is_reason_to_look_at_all_at_once() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, SOFT, 0.02, 60)
    assert choice.order < 4
    changed = settled(choice, RICH, 0.02, 7, 2.41)
    assert 4 in changed[1:6]
    assert choice.order == 4


def test_light_that_had_nothing_above_its_level_is_followed_when_it_has() -> None:
    """Without waiting for the next look at all orders: half a second is twelve frames and a half."""
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    measured = settled(choice, EVEN, 0.02, 60)
    looked = len(measured) - 1 - measured[::-1].index(4)
    settled(choice, EVEN, 0.02, 5, 60 / 25.0)
    low = choice.order
    changed = settled(choice, RICH, 0.02, 12, 65 / 25.0)
    assert low < 4
    assert looked + 50 > 65 + 12
    assert choice.order == 4
    assert changed[-1] == 4


@pytest.mark.parametrize("frames", [8, 12, 16, 20])
def test_light_that_changes_while_all_orders_are_followed_is_drawn_within_three_quarters_of_a_second(
    frames: int,
) -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, EVEN, 0.02, frames)
    assert choice.order == 4
    settled(choice, RICH, 0.02, 18, frames / 25.0)
    light = lighting(RICH, 0.0004)
    low = ORDERS <= 2
    np.testing.assert_allclose(choice.shown(light).coefficients[low], light.coefficients[low], rtol=0.05)


def test_one_frame_that_is_far_off_is_no_other_light() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, SOFT, 0.02, 60)
    order = choice.order
    assert order < 4
    for frame in range(20):
        off = RICH if frame % 4 == 0 else SOFT
        choice.learn(lighting(off, 0.02, frame, order), lighting(off, 0.004, frame, order), (60 + frame) / 25.0)
        assert choice.order == order


def test_looking_in_vain_gets_rarer() -> None:
    """Single frames that show more than the filtered light make the orders rise less and less often."""
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, SOFT, 0.02, 60)
    rises = 0
    for burst in range(30):
        start_s = 10.0 * (burst + 1)
        choice.learn(
            lighting([1.0, 0.03, 0.03, 1.0, 5.0], 0.02, burst),
            lighting(SOFT, 0.004, 1).truncated(choice.order),
            start_s,
        )
        rises += choice.order == 4
        settled(choice, SOFT, 0.02, 100, start_s + 0.04)
        assert choice.order < 4
    assert 1 <= rises <= 8


def test_orders_come_and_go_little_by_little() -> None:
    """Unless the light jumps, by no more than a tenth of what an order adds: half a second is twelve frames."""
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    sunny = [1.0, 0.8, 0.8, 0.5, 0.5]
    orders, steps, last = [], [], None
    for frame in range(400):
        light = SOFT if frame < 100 else sunny
        time_s = frame / 25.0
        seen = lighting(light, 0.02, frame, choice.order_to_measure(time_s))
        filtered = lighting(light, 0.004, 1).truncated(min(choice.order, seen.order))
        choice.learn(seen, filtered, time_s)
        told = np.zeros((len(FREQUENCIES), 3), complex)
        shown = choice.shown(filtered)
        told[: len(shown.coefficients)] = shown.coefficients
        orders.append(shown.order)
        if last is not None and not 100 <= frame < 103:
            steps.append(np.linalg.norm(told - last))
        last = told
    assert min(orders) < 4
    assert orders[103] == orders[-1] == 4
    beyond = min(orders) < ORDERS
    most = max(np.linalg.norm(lighting(light, 0.004, 1).coefficients[beyond]) for light in (SOFT, sunny))
    assert 0.0 < max(steps) < 0.1 * most


def test_light_that_drifts_is_drawn_without_a_jump() -> None:
    """From soft to sunny in ten seconds: no frame changes by more than a tenth of the whole way."""
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    orders, told = [], []
    for frame in range(500):
        share = min(max((frame - 100) / 250.0, 0.0), 1.0)
        light = [1.0, *(0.03 + share * amplitude for amplitude in (0.8, 0.8, 0.5, 0.5))]
        time_s = frame / 25.0
        seen = lighting(light, 0.02, frame, choice.order_to_measure(time_s))
        filtered = lighting(light, 0.004, 1).truncated(min(choice.order, seen.order))
        choice.learn(seen, filtered, time_s)
        shown = choice.shown(filtered)
        orders.append(shown.order)
        told.append(np.zeros((len(FREQUENCIES), 3), complex))
        told[-1][: len(shown.coefficients)] = shown.coefficients
    assert min(orders) < 4
    assert orders[-1] == 4
    steps = np.linalg.norm(np.diff(told, axis=0), axis=(1, 2))
    assert steps.max() < 0.1 * np.linalg.norm(told[-1] - told[100])


def test_what_an_effort_leaves_of_the_orders_is_weighed_too() -> None:
    """Drawn by how well it is known although the others are never seen, and another light at once."""
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    for frame in range(60):
        light = RICH if frame < 40 else SOFT
        true, measured = lighting(light, 0.0, 0, 2), lighting(light, 0.1, frame + 1000, 2)
        choice.learn(lighting(light, 0.2, frame, 2), measured, frame / 25.0)
        away = [np.linalg.norm(each.coefficients - true.coefficients) for each in (choice.shown(measured), measured)]
        # the second frame of another light is believed
        if not 40 <= frame < 42:
            assert away[0] < away[1]
    assert choice.order == 4


def test_lighting_that_is_well_known_is_shown_as_it_is_once_the_order_has_settled() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    settled(choice, RICH, 1e-5)
    light = lighting(RICH, 1e-5)
    np.testing.assert_allclose(choice.shown(light).coefficients, light.coefficients, atol=1e-4)
    settled(choice, SOFT, 0.02, 100, 100.0)
    # a look at all orders is not shown
    assert choice.shown(lighting(SOFT, 0.003)).order == choice.order < 4


def test_what_is_hardly_known_is_shown_closer_to_the_truth_than_it_was_measured() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0, 1.0, 1.0, 1.0, 1e-4]))
    settled(choice, RICH, 0.02)
    true = lighting(RICH, 0.0).truncated(choice.order).coefficients
    measured = [lighting(RICH, 0.02, seed, choice.order) for seed in range(10)]
    shown, as_it_was = (
        np.sqrt(np.mean([np.abs(light.coefficients - true) ** 2 for light in lights]))
        for lights in ([choice.shown(light) for light in measured], measured)
    )
    assert shown < as_it_was


def test_orders_at_the_edge_of_being_needed_do_not_flicker() -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0, 1.0, 1.0, 0.012, 0.0]))
    chosen = []
    for frame in range(250):
        time_s = frame / 25.0
        order = choice.order_to_measure(time_s)
        seen = lighting([1.0, 0.3, 0.2, 0.03, 0.0], 0.002, frame, order)
        filtered = lighting([1.0, 0.3, 0.2, 0.03, 0.0], 0.0004, frame + 1000, min(order, choice.order))
        choice.learn(seen, filtered, time_s)
        chosen.append(choice.order)
    changes = np.count_nonzero(np.diff(chosen))
    assert changes <= 4


@pytest.mark.parametrize("level", [0.0, 1e-9])
def test_darkness_asks_for_nothing_impossible(level: float) -> None:
    choice = OrderChoice(Anywhere(FREQUENCIES), need([1.0] * 5))
    dark = lighting([1.0, 0.3, 0.2, 0.2, 0.2], 0.01)
    dark = dark.scaled(np.full(3, level))
    choice.learn(dark, dark, 0.0)
    assert 0 <= choice.order <= 4
