"""Tone curves rise, invert, and follow the wedge."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from arlight.errors import ProbeError
from arlight.probe.assembly import Print
from arlight.probe.tone import ToneCurve

SHARES = np.linspace(0.0, 1.0, 11)


@given(
    steps=st.lists(st.floats(0.001, 1.0), min_size=10, max_size=10),
    solid=st.floats(0.0, 0.5),
)
@settings(max_examples=60, deadline=None)
def test_curve_is_monotone_and_inverts(steps, solid):
    rise = np.concatenate([[0.0], np.cumsum(steps)])
    tone = ToneCurve.of_wedge(SHARES, solid + (1.0 - solid) * rise / rise[-1])
    fine = np.linspace(0.0, 1.0, 301)
    printed = tone.print_of(fine)
    assert np.all(np.diff(printed) >= 0.0)
    assert printed[-1] == pytest.approx(1.0)
    np.testing.assert_allclose(tone.print_of(tone.share_for(printed)), printed, atol=1e-4)
    np.testing.assert_allclose(tone.share_for(tone.print_of(SHARES)), SHARES, atol=1e-3)


@pytest.mark.parametrize("gain", [0.0, 0.1, 0.2])
def test_modelled_print_is_followed_and_undone(gain):
    made = Print(dot_gain=gain, solid=0.05)
    tone = ToneCurve.of_print(made)
    assert tone.dot_gain == pytest.approx(gain, abs=1e-6)
    assert tone.solid == 0.05
    value = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(tone.print_of(value), made.tone(value), atol=1e-3)
    # in proportion from what solid ink leaves: no harmonic is added to a sinusoid
    np.testing.assert_allclose(made.tone(tone.compensated(value)), 0.05 + 0.95 * value, atol=1e-3)


def test_a_wedge_of_few_steps_is_as_good_as_many():
    made = Print(dot_gain=0.15, solid=0.03)
    tone = ToneCurve.of_wedge(SHARES, made.tone(SHARES))
    value = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(tone.print_of(value), made.tone(value), atol=2e-3)


def test_order_scale_and_repeated_steps_do_not_matter():
    measured = Print(dot_gain=0.1).tone(SHARES)
    shuffled = np.random.default_rng(1).permutation(11)
    asked = np.concatenate([SHARES[shuffled], SHARES])
    twice = np.concatenate([measured[shuffled] * 70.0 + 1.0, measured * 70.0 - 1.0 + 2.0 * (measured == 0)])
    reference = ToneCurve.of_wedge(SHARES, measured)
    value = np.linspace(0.05, 1.0, 51)
    np.testing.assert_allclose(ToneCurve.of_wedge(asked, twice).print_of(value), reference.print_of(value), atol=0.015)


def test_noise_that_makes_steps_fall_a_little_is_smoothed():
    measured = Print().tone(SHARES)
    measured[4] = measured[5] + 0.01
    tone = ToneCurve.of_wedge(SHARES, measured)
    assert np.all(np.diff(tone.printed) > 0.0)
    assert float(tone.print_of(0.45)) == pytest.approx(measured[4:6].mean(), abs=0.01)


@pytest.mark.parametrize(
    ("asked", "measured", "message"),
    [
        (SHARES, np.where(SHARES == 0.5, 0.1, SHARES), "not monotone: the step with 0.5 of its dots"),
        (SHARES, 1.0 - SHARES, "unprinted step measures 0"),
        (SHARES, 1.5 - SHARES, "solid step is 3.00"),
        (SHARES, np.ones(11), "solid step is 1.00"),
        (SHARES, np.zeros(11), "unprinted step measures 0"),
        (SHARES, np.where(SHARES == 0.5, np.nan, SHARES), "must be numbers"),
        (SHARES, SHARES - 0.1, "0 or more"),
        (SHARES[1:], SHARES[1:], "from solid"),
        (SHARES[[0, 1, 2, 10]], SHARES[[0, 1, 2, 10]], "none more than"),
        (SHARES[[0, 10]], SHARES[[0, 10]], "4 or more different steps"),
        (SHARES, SHARES[1:], "each of its 11 steps, found 10"),
    ],
)
def test_wedges_that_tell_no_tone_are_refused(asked, measured, message):
    with pytest.raises(ProbeError, match=message):
        ToneCurve.of_wedge(asked, measured)


@pytest.mark.parametrize(
    ("asked", "printed"),
    [((0.0, 1.0), (0.2, 0.9)), ((0.0, 0.5, 1.0), (0.2, 0.1, 1.0)), ((0.1, 1.0), (0.0, 1.0)), ((0.0, 1.0), (1.0,))],
)
def test_impossible_curves_are_refused(asked, printed):
    with pytest.raises(ProbeError, match="tone curve"):
        ToneCurve(asked, printed)
