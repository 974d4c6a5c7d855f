"""Rows of stripes: their phase, and which of them can be used."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.stripe_rows import HARMONIC_OF_ROW, turned_rows, usable_rows


def rows_of(wave):
    """Mean, cosine and sine rows of a function of the phase."""
    phase = 2 * np.pi * np.arange(64) / 64
    values = wave(phase)
    rows = [values.mean()]
    for m in (1, 2, 3):
        rows += [2 * np.mean(values * np.cos(m * phase)), 2 * np.mean(values * np.sin(m * phase))]
    return np.array(rows)[None]


@pytest.mark.parametrize("lead", [0.0, 0.4, -2.5, 7.0])
def test_stripes_that_lie_ahead_are_the_same_stripes_at_another_phase(lead):
    def wave(phase):
        return 0.5 + 0.3 * np.cos(phase - 1.0) + 0.1 * np.sin(2 * phase) - 0.05 * np.cos(3 * phase + 0.2)

    there = rows_of(lambda phase: wave(phase + lead))
    np.testing.assert_allclose(turned_rows(rows_of(wave), np.array([lead])), there, atol=1e-12)


def test_turns_add_up_keep_amplitudes_and_leave_the_rows_as_they_were():
    generator = np.random.default_rng(1)
    rows, first, second = generator.normal(size=(5, 7, 3)), generator.normal(size=5), generator.normal(size=5)
    before = rows.copy()
    twice = turned_rows(turned_rows(rows, first), second)
    np.testing.assert_allclose(twice, turned_rows(rows, first + second), atol=1e-12)
    np.testing.assert_allclose(np.hypot(twice[:, 1::2], twice[:, 2::2]), np.hypot(rows[:, 1::2], rows[:, 2::2]))
    np.testing.assert_array_equal(twice[:, 0], rows[:, 0])
    np.testing.assert_array_equal(rows, before)


def test_columns_are_turned_alike():
    rows, lead = np.random.default_rng(2).normal(size=(4, 7, 2)), np.array([0.1, 1.0, -2.0, 3.0])
    for column in range(2):
        np.testing.assert_allclose(turned_rows(rows[..., column], lead), turned_rows(rows, lead)[..., column])


def test_rows_are_used_where_they_were_measured_and_blur_leaves_them(blank):
    means = blank()
    clear = np.ones((len(means.valid), 7))
    usable = usable_rows(replace(means, harmonics=np.arange(len(clear)) % 4), clear)
    np.testing.assert_array_equal(usable.sum(axis=1), 1 + 2 * (np.arange(len(clear)) % 4))
    soft = clear.copy()
    soft[:, HARMONIC_OF_ROW == 2] = 0.01
    assert not usable_rows(means, soft)[:, HARMONIC_OF_ROW == 2].any()
    assert usable_rows(means, 0.0 * clear)[:, 0].all()


def test_a_block_that_was_not_seen_has_no_rows(blank):
    means = blank()
    unseen = np.arange(len(means.valid)) % 3 == 0
    usable = usable_rows(replace(means, valid=~unseen), np.ones((len(unseen), 7)))
    assert not usable[unseen].any()
    assert usable[~unseen, 0].all()
