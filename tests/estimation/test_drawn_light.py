"""Weights of a light's coefficients that change little by little."""

import numpy as np

from arlight.estimation.drawn_light import DrawnLight

PACKED = np.random.default_rng(3).standard_normal((6, 3))


def weights(seed):
    return np.random.default_rng(seed).standard_normal((6, 6))


def test_coefficients_stay_as_they_are_until_weights_are_known_and_the_first_hold_at_once():
    drawn = DrawnLight(6)
    np.testing.assert_array_equal(drawn.weighed(PACKED), PACKED)
    drawn.pass_to(weights(1))
    np.testing.assert_allclose(drawn.weighed(PACKED), weights(1) @ PACKED)


def test_weights_pass_in_even_steps_and_arrive():
    drawn = DrawnLight(6)
    drawn.pass_to(weights(1))
    drawn.pass_to(weights(2))
    told = [drawn.weighed(PACKED)]
    while not drawn.settled:
        drawn.wait(0.05)
        told.append(drawn.weighed(PACKED))
    steps = np.diff(told, axis=0)
    assert len(steps) >= 8
    np.testing.assert_allclose(steps[:-1], np.broadcast_to(steps[0], steps[:-1].shape), atol=1e-12)
    np.testing.assert_allclose(told[0], weights(1) @ PACKED)
    np.testing.assert_allclose(told[-1], weights(2) @ PACKED)


def test_a_change_of_mind_half_way_makes_no_jump():
    drawn = DrawnLight(6)
    drawn.pass_to(weights(1))
    drawn.pass_to(weights(2))
    drawn.wait(0.2)
    before = drawn.weighed(PACKED)
    drawn.pass_to(weights(3))
    np.testing.assert_allclose(drawn.weighed(PACKED), before)


def test_fewer_coefficients_are_weighed_by_the_first_weights():
    drawn = DrawnLight(6)
    drawn.pass_to(weights(1))
    np.testing.assert_allclose(drawn.weighed(PACKED[:3]), weights(1)[:3, :3] @ PACKED[:3])


def test_weights_that_are_no_numbers_are_gone_with_the_next_but_one():
    drawn = DrawnLight(6)
    drawn.pass_to(np.full((6, 6), np.nan))
    for seed in (1, 2):
        drawn.pass_to(weights(seed))
        drawn.wait(10.0)
    np.testing.assert_allclose(drawn.weighed(PACKED), weights(2) @ PACKED)


def test_reset_forgets_the_weights():
    drawn = DrawnLight(6)
    drawn.pass_to(weights(1))
    drawn.pass_to(weights(2))
    drawn.reset()
    np.testing.assert_array_equal(drawn.weighed(PACKED), PACKED)
    drawn.pass_to(weights(3))
    assert drawn.settled
