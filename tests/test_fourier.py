import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from arlight.errors import ProbeError
from arlight.fourier import (
    MAX_ORDER,
    analyse,
    frequency_order,
    half_plane_frequencies,
    pack_real,
    synthesise,
    unpack_real,
)

ORDERS = range(MAX_ORDER + 1)
LIGHTS = arrays(float, (7, 3), elements=st.floats(0, 1e4, allow_subnormal=False))
POINTS = np.random.default_rng(0).uniform(-0.5, 0.5, (7, 2))


def coefficients_of(frequencies, seed, channels=3):
    generator = np.random.default_rng(seed)
    real = generator.normal(size=(len(frequencies), channels))
    imaginary = generator.normal(size=(len(frequencies), channels))
    imaginary[0] = 0
    return real + 1j * imaginary


def grid_of(count):
    axis = (np.arange(count) + 0.5) / count - 0.5
    x, y = np.meshgrid(axis, axis)
    return np.stack([x.ravel(), y.ravel()], axis=1)


@pytest.mark.parametrize(("order", "pairs"), [(0, 0), (1, 2), (2, 6), (3, 14), (4, 24), (5, 40)])
def test_number_of_frequencies(order, pairs):
    assert 2 * (len(half_plane_frequencies(order)) - 1) + 1 == 2 * pairs + 1


@pytest.mark.parametrize("order", ORDERS)
def test_with_their_negatives_they_are_the_disk_once_each(order):
    half = {tuple(n) for n in half_plane_frequencies(order).tolist()}
    other = {(-u, -v) for u, v in half}
    span = range(-order, order + 1)
    assert half | other == {(u, v) for u in span for v in span if np.hypot(u, v) <= order}
    assert half & other == {(0, 0)}


@pytest.mark.parametrize("order", ORDERS)
def test_frequencies_come_in_rising_order(order):
    frequencies = half_plane_frequencies(order)
    assert frequencies[0].tolist() == [0, 0]
    assert np.all(np.diff(np.sum(frequencies**2, axis=1)) >= 0)
    # a lower order's set is the beginning of a higher one's
    np.testing.assert_array_equal(frequencies, half_plane_frequencies(MAX_ORDER)[: len(frequencies)])


@pytest.mark.parametrize("order", [-1, MAX_ORDER + 1, 100])
def test_impossible_orders_are_refused(order):
    with pytest.raises(ProbeError, match="order must lie between"):
        half_plane_frequencies(order)


def test_order_is_the_length_rounded_up():
    found = frequency_order([[0, 0], [1, 0], [0, -1], [1, 1], [2, 0], [3, 4], [-4, 3], [5, 1], [4, 4]])
    assert found.tolist() == [0, 1, 1, 2, 2, 5, 5, 6, 6]
    for order in ORDERS:
        assert frequency_order(half_plane_frequencies(order)).max() == order


@pytest.mark.parametrize("order", [0, 1, 5, 8])
def test_analysis_inverts_synthesis(order):
    frequencies = half_plane_frequencies(order)
    coefficients = coefficients_of(frequencies, order)
    # equal spacing: waves of different frequencies are orthogonal on it
    points = grid_of(2 * order + 1)
    light = synthesise(coefficients, points, frequencies)
    np.testing.assert_allclose(analyse(light / len(points), points, frequencies), coefficients, atol=1e-12)


def test_synthesis_is_the_sum_over_the_whole_plane():
    frequencies = half_plane_frequencies(4)
    coefficients = coefficients_of(frequencies, 1)
    total = np.zeros((len(POINTS), 3), complex)
    for (u, v), c in zip(frequencies.tolist(), coefficients, strict=True):
        for sign, value in ((1, c), (-1, np.conj(c)))[: 1 if (u, v) == (0, 0) else 2]:
            total += np.exp(2j * np.pi * sign * (u * POINTS[:, :1] + v * POINTS[:, 1:])) * value
    np.testing.assert_allclose(total.imag, 0, atol=1e-12)
    np.testing.assert_allclose(synthesise(coefficients, POINTS, frequencies), total.real, atol=1e-12)


def test_one_lamp_has_equally_strong_coefficients_and_its_place_in_their_phase():
    frequencies = half_plane_frequencies(5)
    coefficients = analyse([[2.0]], [[0.11, -0.3]], frequencies)[:, 0]
    np.testing.assert_allclose(abs(coefficients), 2, rtol=1e-12)
    across = coefficients[np.all(frequencies == [1, 0], axis=1)][0]
    upward = coefficients[np.all(frequencies == [0, 1], axis=1)][0]
    assert np.angle(across) / (-2 * np.pi) == pytest.approx(0.11)
    assert np.angle(upward) / (-2 * np.pi) == pytest.approx(-0.3)


def test_a_quarter_turn_of_the_light_permutes_the_coefficients():
    frequencies = half_plane_frequencies(5)
    generator = np.random.default_rng(2)
    light, points = generator.uniform(0, 1, (40, 3)), generator.uniform(-0.35, 0.35, (40, 2))
    before = dict(zip(map(tuple, frequencies.tolist()), analyse(light, points, frequencies), strict=True))
    turned = analyse(light, np.stack([-points[:, 1], points[:, 0]], axis=1), frequencies)
    for (u, v), found in zip(frequencies.tolist(), turned, strict=True):
        # the frequency that a quarter turn brings to (u, v), or its negative
        source = (v, -u)
        expected = before[source] if source in before else np.conj(before[(-v, u)])
        np.testing.assert_allclose(found, expected, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(LIGHTS, LIGHTS, st.floats(0, 100))
def test_analysis_is_linear(first, second, share):
    frequencies = half_plane_frequencies(3)
    together = analyse(first + share * second, POINTS, frequencies)
    apart = analyse(first, POINTS, frequencies) + share * analyse(second, POINTS, frequencies)
    np.testing.assert_allclose(together, apart, rtol=1e-9, atol=1e-6)


@settings(max_examples=50, deadline=None)
@given(LIGHTS)
def test_no_coefficient_exceeds_the_mean_of_positive_light(light):
    coefficients = analyse(light, POINTS, half_plane_frequencies(4))
    np.testing.assert_allclose(coefficients[0], light.sum(axis=0), rtol=1e-12)
    assert np.all(abs(coefficients) <= coefficients[0].real * (1 + 1e-12))


@settings(max_examples=50, deadline=None)
@given(arrays(float, (5, 3), elements=st.floats(-1e6, 1e6)), arrays(float, (5, 3), elements=st.floats(-1e6, 1e6)))
def test_packing_is_undone_exactly(real, imaginary):
    coefficients = real + 1j * imaginary
    coefficients[0] = real[0]
    packed = pack_real(coefficients)
    assert packed.shape == (9, 3)
    np.testing.assert_array_equal(unpack_real(packed), coefficients)
    np.testing.assert_array_equal(pack_real(unpack_real(packed)), packed)


def test_packed_order_is_mean_then_real_and_imaginary_parts():
    assert pack_real([5.0, 1 + 2j, 3 - 4j]).tolist() == [5, 1, 2, 3, -4]
    assert pack_real([5.0 + 0j]).tolist() == [5]
