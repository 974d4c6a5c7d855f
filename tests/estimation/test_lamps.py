"""Mirrored extras of single blocks, eliminated from their rows."""

import numpy as np
import pytest

from arlight.estimation.lamps import BesideLamps

BLOCKS, ROWS = 6, 7
MIRROR = np.concatenate([np.ones((BLOCKS, 1)), 0.2 * np.random.default_rng(1).normal(size=(BLOCKS, ROWS - 1))], axis=1)


def precision_matrices(seed=2):
    factors = np.random.default_rng(seed).normal(size=(BLOCKS, ROWS, 3 * ROWS))
    return factors @ factors.swapaxes(1, 2) / ROWS


def test_eliminating_is_the_same_as_a_wider_covariance():
    precision, variance = precision_matrices(), np.linspace(0.0, 30.0, BLOCKS)
    wider = np.linalg.inv(precision) + variance[:, None, None] * MIRROR[:, :, None] * MIRROR[:, None, :]
    np.testing.assert_allclose(
        BesideLamps.of(precision, MIRROR, variance).precision, np.linalg.inv(wider), rtol=1e-8, atol=1e-8
    )


def test_the_extra_is_what_least_squares_with_an_unknown_of_its_own_finds():
    precision, variance = precision_matrices(), np.full(BLOCKS, 0.7)
    missed = np.random.default_rng(3).normal(size=(BLOCKS, ROWS))
    lamps = BesideLamps.of(precision, MIRROR, variance)
    for block in range(BLOCKS):
        m, p = MIRROR[block], precision[block]
        spread = 1.0 / (m @ p @ m + 1.0 / variance[block])
        assert lamps.spread[block] == pytest.approx(spread)
        assert lamps.extra(missed)[block] == pytest.approx(spread * (m @ p @ missed[block]))


def test_what_a_lamp_could_have_done_tells_nothing_when_any_lamp_may_be():
    endless = BesideLamps.of(precision_matrices(), MIRROR, np.full(BLOCKS, 1e12)).precision
    np.testing.assert_allclose(np.einsum("brs,bs->br", endless, MIRROR), 0.0, atol=1e-6)
    across = np.random.default_rng(4).normal(size=(BLOCKS, ROWS))
    across -= MIRROR * (np.sum(across * MIRROR, axis=1) / np.sum(MIRROR**2, axis=1))[:, None]
    assert np.all(np.einsum("br,brs,bs->b", across, endless, across) > 0.1)


def test_independent_rows_are_a_diagonal_matrix():
    weights, variance = np.random.default_rng(5).uniform(0.1, 2.0, (BLOCKS, ROWS)), np.full(BLOCKS, 0.3)
    short = BesideLamps.of(weights, MIRROR, variance)
    full = BesideLamps.of(np.stack([np.diag(row) for row in weights]), MIRROR, variance)
    np.testing.assert_allclose(short.precision, full.precision, atol=1e-15)
    np.testing.assert_allclose(short.spread, full.spread)


def test_a_block_without_weight_has_no_extra():
    lamps = BesideLamps.of(np.zeros((BLOCKS, ROWS)), MIRROR, np.full(BLOCKS, 0.5))
    np.testing.assert_array_equal(lamps.extra(np.ones((BLOCKS, ROWS))), 0.0)
    np.testing.assert_array_equal(lamps.spread, 0.5)


def test_what_is_granted_settles_on_the_extra_of_a_lamp_and_on_the_usual_elsewhere():
    precision = np.full((2, ROWS), 1e6)
    lit = np.array([0.0, 0.4])
    ordinary, variance = np.full(2, 1e-4), np.full(2, 0.02)
    for _ in range(60):
        lamps = BesideLamps.of(precision, MIRROR[:2], variance)
        extra = lamps.extra(MIRROR[:2] * lit[:, None])
        variance = lamps.granted(extra, ordinary)
    np.testing.assert_allclose(extra, lit, atol=1e-4)
    # four parts of the usual and one of its own square
    np.testing.assert_allclose(variance, (4.0 * ordinary + lit**2) / 5.0, rtol=0.02)
