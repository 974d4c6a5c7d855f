"""Corrections as unknowns: their place in an assembly, and the spread that they teach."""

import numpy as np
import pytest

from arlight.calibration.known_lighting.block_corrections import (
    KINDS,
    MODEL,
    CorrectionPrior,
    corrections_of,
    learnt_prior,
    with_corrections,
)
from arlight.probe.assembly import Assembly

COUNT = 400


def test_an_assembly_returns_its_corrections():
    corrections = np.random.default_rng(0).normal(MODEL, 0.1, (7, 4))
    assembly = with_corrections(Assembly(glass_scale=1.01), corrections, gain=2.0)
    assert assembly.glass_scale == 1.01
    found = corrections_of(assembly, 7)
    np.testing.assert_allclose(found[:, 0], 2.0 * corrections[:, 0])
    np.testing.assert_allclose(found[:, 1:], corrections[:, 1:])
    np.testing.assert_array_equal(corrections_of(Assembly(), 3), np.tile(MODEL, (3, 1)))


def settled(corrections, error):
    widest = prior = CorrectionPrior()
    for _ in range(60):
        # what is found with a prior is shrunk by it
        variance = 1.0 / (1.0 / error**2 + 1.0 / prior.stddev**2) * np.ones_like(corrections)
        shrunk = MODEL + (corrections - MODEL) * (variance / error**2)
        prior, spread = learnt_prior(prior, shrunk, variance, widest)
    return prior, spread


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_the_spread_of_well_measured_corrections_is_learnt(share):
    widest = CorrectionPrior().stddev
    corrections = MODEL + np.random.default_rng(1).normal(0, 1, (COUNT, 4)) * share * widest
    prior, _ = settled(corrections, 1e-3 * widest)
    # of normal corrections a Student-t of four degrees keeps the scale to a fifth
    np.testing.assert_allclose(prior.stddev, share * widest, rtol=0.25)


def test_no_corrections_teach_the_narrowest_prior():
    prior, _ = settled(np.tile(MODEL, (COUNT, 1)), 0.1 * CorrectionPrior().stddev)
    np.testing.assert_allclose(prior.stddev, 0.1 * CorrectionPrior().stddev)


def test_one_spoilt_block_is_let_go_and_teaches_little():
    widest = CorrectionPrior().stddev
    corrections = MODEL + np.random.default_rng(2).normal(0, 0.2, (COUNT, 4)) * widest
    before, _ = settled(corrections, 1e-3 * widest)
    corrections[7] = MODEL + 10.0 * widest
    after, spread = settled(corrections, 1e-3 * widest)
    np.testing.assert_allclose(after.stddev, before.stddev, rtol=0.03)
    assert np.all(spread[7] > 10.0 * np.median(spread, axis=0))


def test_kinds_are_the_assemblys_own():
    assembly = with_corrections(Assembly(), np.tile(MODEL, (2, 1)))
    assert all(hasattr(assembly.blocks, kind) for kind in KINDS)
