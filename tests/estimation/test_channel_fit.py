"""One channel: what is fitted, what is left out, and what each frame reveals beside the light."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.channel_fit import fit_channel
from arlight.estimation.normal_equations import BlockSystem
from arlight.estimation.nuisance import Nuisance
from arlight.fourier import pack_real
from arlight.tracking.block_layout import field_blocks

GREEN = 1


@pytest.fixture(scope="module")
def white(probe, random_light):
    """Radiance of clear film on white paper in light as `random_light` makes it."""
    return float(random_light(0)[0, GREEN].real * probe.paper_reflectance * probe.film_transmittance**2 / np.pi)


@pytest.fixture(scope="module")
def fit(probe, response, white):
    """Fit green with a wide prior and a reflection that is a plane over the sheet."""
    blocks = field_blocks(probe)
    plane = np.column_stack([np.ones(len(blocks)), np.array([block.center_mm for block in blocks]) / 50.0])
    unknown = 2 * len(probe.frequencies) - 1 + plane.shape[1]
    system = BlockSystem(response.places, plane, np.zeros(unknown), np.full(unknown, 100.0))
    model = np.full(len(blocks), 0.001)

    def solve(means, nuisance=None, passes=1):
        nuisance = nuisance or Nuisance()
        rows, lower = response.light(means), response.lower_mirror(means)
        for _ in range(passes):
            found = fit_channel(means, GREEN, white, rows, lower, model, system, nuisance)
            nuisance = found.nuisance
        return found

    return solve


def error(found, truth):
    return np.abs(found.packed - pack_real(truth)[:, GREEN]).max() / truth[0, GREEN].real


@pytest.mark.parametrize("seed", range(3))
def test_exact_rows_are_solved(fit, blank, lit_as_usual, random_light, probe, seed):
    truth = random_light(seed)
    plane = 0.03 + 0.01 * np.array([[b.center_mm[0] / 50.0] for b in field_blocks(probe)])
    found = fit(lit_as_usual(blank(), truth, mirrored=plane))
    # with a prior this wide there is nothing that pulls
    assert error(found, truth) < 2e-3
    np.testing.assert_allclose(found.field, plane[:, 0], atol=3e-4)
    np.testing.assert_allclose(found.reflection, plane[:, 0], atol=3e-4)
    assert found.chi2 < 0.01


def test_predictions_are_the_rows_that_were_given(fit, blank, lit_as_usual, random_light):
    means = lit_as_usual(blank(), random_light(3), mirrored=0.04)
    np.testing.assert_allclose(fit(means).predicted, means.values[:, :, GREEN], atol=1e-3)


def test_mirrored_lamps_are_read_off_block_by_block(fit, blank, lit_as_usual, random_light):
    truth, means = random_light(4), blank()
    lamps = np.zeros((len(means.valid), 3))
    struck = np.random.default_rng(1).choice(len(lamps), 6, replace=False)
    lamps[struck] = np.linspace(0.05, 0.9, 6)[:, None]
    found = fit(lit_as_usual(means, truth, mirrored=0.02 + lamps))
    np.testing.assert_allclose(found.field, 0.02, atol=0.003)
    np.testing.assert_allclose(found.reflection[struck], 0.02 + lamps[struck, 0], rtol=0.05, atol=0.003)
    assert error(found, truth) < 5e-3


def test_rows_that_stray_are_given_little_weight(fit, blank, lit_as_usual, random_light, white):
    truth = random_light(5)
    means = lit_as_usual(blank(), truth)
    generator = np.random.default_rng(2)
    spoilt = means.values.copy()
    for block in generator.choice(np.flatnonzero(means.harmonics > 0), 8, replace=False):
        spoilt[block, generator.integers(1, 7)] += generator.choice([-1, 1]) * 0.3 * white
    found = fit(replace(means, values=spoilt))
    assert error(found, truth) < 0.02
    assert found.chi2 > fit(means).chi2


def test_what_was_not_measured_does_not_count(fit, blank, lit_as_usual, random_light):
    truth = random_light(6)
    means = lit_as_usual(blank(), truth)
    fewer = replace(means, harmonics=np.minimum(means.harmonics, 2), valid=np.arange(len(means.valid)) % 7 != 3)
    expected = fit(fewer)
    garbage = means.values.copy()
    garbage[~fewer.valid] = 7.0
    garbage[:, 5:] = -3.0
    found = fit(replace(fewer, values=garbage))
    np.testing.assert_allclose(found.packed, expected.packed, atol=1e-9)
    np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-6, atol=1e-12)
    assert found.chi2 == pytest.approx(expected.chi2)
    # with less to go by it is less certain
    assert np.all(np.diagonal(expected.covariance) > np.diagonal(fit(means).covariance))


@pytest.mark.parametrize("blur", [0.0, 0.2, 0.6, 1.0, 2.0])
def test_blur_is_found_from_wherever_it_starts(fit, blank, lit_as_usual, random_light, blur):
    truth = random_light(7)
    means = lit_as_usual(blank(), truth, blur_variance_px2=blur)
    for start in (0.1, 0.5, 1.2):
        found = fit(means, Nuisance(blur_variance_px2=start), passes=10)
        assert found.nuisance.blur_variance_px2 == pytest.approx(blur, abs=0.03)
        assert error(found, truth) < 0.01


def test_nuisance_stays_in_its_range_on_nonsense(fit, blank):
    means = blank()
    noise = np.random.default_rng(3).normal(size=means.values.shape)
    nuisance = fit(replace(means, values=noise), passes=4).nuisance
    assert 0.0 <= nuisance.blur_variance_px2 < 20.0
    assert 0.0 <= nuisance.lower_face <= 2.0


def test_paper_that_sticks_to_the_glass_shows_in_the_lower_face(fit, blank, lit_as_usual, random_light):
    truth = random_light(8)
    for face in (0.4, 1.0):
        found = fit(lit_as_usual(blank(), truth, mirrored=0.1, lower_face=face), passes=20)
        assert found.nuisance.lower_face == pytest.approx(face, abs=0.03)
        assert error(found, truth) < 0.01


def test_without_blocks_the_prior_and_the_first_guess_are_left(fit, blank, lit_as_usual, random_light):
    means = lit_as_usual(blank(), random_light(9))
    start = Nuisance(0.7, 0.9)
    found = fit(replace(means, valid=np.zeros(len(means.valid), bool)), start)
    assert np.isnan(found.chi2)
    np.testing.assert_allclose(found.packed, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diagonal(found.covariance)), 100.0, rtol=1e-9)
    assert found.nuisance.blur_variance_px2 == pytest.approx(0.7)
    assert 0.9 <= found.nuisance.lower_face <= 1.0
