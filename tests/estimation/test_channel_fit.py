"""One channel: what is fitted, what is left out, and what each frame reveals beside the light."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.channel_fit import GREEN
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.prior import prior_stddev
from arlight.estimation.stripe_rows import HARMONIC_OF_ROW, turned_rows
from arlight.fourier import pack_real


@pytest.fixture(scope="module")
def white(probe, random_light):
    """Radiance of clear film on white paper in light as `random_light` makes it."""
    return float(random_light(0)[0, GREEN].real * probe.paper_reflectance * probe.film_transmittance**2 / np.pi)


@pytest.mark.parametrize("count", [1, 3, 9])
def test_fewer_frequencies_are_the_same_as_a_smaller_problem(fitted, blank, lit_as_usual, random_light, count):
    means = lit_as_usual(blank(sigma=0.004), random_light(7), mirrored=0.04, noise_seed=7)
    own = fitted.response.places[:, 1] > 2 * count - 2
    # blocks of other frequencies are as good as not there
    fitted.start(replace(means, valid=means.valid & ~own))
    fitted.sheet.fit(GREEN, 2, settle=True)
    unknown = 2 * count - 1
    packed, covariance = fitted.sheet.packed[GREEN, :unknown], fitted.sheet.covariance[GREEN, :unknown, :unknown]
    garbage = means.values.copy()
    garbage[own] = np.nan
    fitted.start(replace(means, values=garbage), count=count)
    assert fitted.used == np.count_nonzero(~own)
    fitted.sheet.fit(GREEN, 2, settle=True)
    assert fitted.sheet.packed.shape == (3, unknown)
    # but for the mean of what all used blocks mirror, on which the field's prior depends
    level = packed[0]
    np.testing.assert_allclose(fitted.sheet.packed[GREEN], packed, atol=1e-4 * level)
    np.testing.assert_allclose(fitted.sheet.covariance[GREEN], covariance, rtol=0.02, atol=1e-8 * level**2)


def settled(fitted, means, nuisance=None, frames=1):
    """Green after several frames, each starting from the one before."""
    fitted.start(means, nuisance)
    for _ in range(frames):
        found = fitted.sheet.fit(GREEN, 4, settle=True)
    return found


def error(fitted, truth):
    return np.abs(fitted.sheet.packed[GREEN] - pack_real(truth)[:, GREEN]).max() / truth[0, GREEN].real


@pytest.mark.parametrize("seed", range(3))
def test_exact_rows_are_solved(fitted, blank, lit_as_usual, random_light, fresnel, plane, seed):
    truth, means = random_light(seed), blank()
    mirrored = fresnel(means) * (0.03 + 0.01 * plane[:, 1:2])
    found = settled(fitted, lit_as_usual(means, truth, mirrored=mirrored))
    assert error(fitted, truth) < 3e-3
    np.testing.assert_allclose(fitted.planes("reflection"), mirrored[:, 0], atol=3e-4)
    assert found.chi2 < 0.01
    assert found.unexplained < 0.01


def test_predictions_are_the_rows_that_were_given(fitted, blank, lit_as_usual, random_light):
    means = lit_as_usual(blank(), random_light(3), mirrored=0.04)
    settled(fitted, means)
    np.testing.assert_allclose(fitted.planes("predicted").T, means.values[:, :, GREEN], atol=1e-3)


def test_mirrored_lamps_are_read_off_block_by_block(fitted, blank, lit_as_usual, random_light, fresnel):
    truth, means = random_light(4), blank()
    lamps = np.zeros((len(means.valid), 3))
    struck = np.random.default_rng(1).choice(len(lamps), 6, replace=False)
    lamps[struck] = np.linspace(0.05, 0.9, 6)[:, None]
    even = 0.02 * fresnel(means)
    settled(fitted, lit_as_usual(means, truth, mirrored=even + lamps))
    expected = (even + lamps)[:, 0]
    np.testing.assert_allclose(fitted.planes("reflection")[struck], expected[struck], rtol=0.05, atol=0.003)
    np.testing.assert_allclose(fitted.planes("reflection"), expected, atol=0.02)
    assert error(fitted, truth) < 5e-3


def test_rows_that_stray_are_given_little_weight(fitted, blank, lit_as_usual, random_light, white):
    truth = random_light(5)
    means = lit_as_usual(blank(), truth)
    generator = np.random.default_rng(2)
    spoilt, struck = means.values.copy(), generator.choice(np.flatnonzero(means.harmonics > 0), 8, replace=False)
    for block in struck:
        spoilt[block, generator.integers(1, 7)] += generator.choice([-1, 1]) * 0.3 * white
    calm = settled(fitted, means)
    found = settled(fitted, replace(means, values=spoilt))
    assert error(fitted, truth) < 0.02
    assert found.chi2 > calm.chi2
    assert np.all(fitted.planes("weights")[struck] < 0.1)


def test_what_was_not_measured_does_not_count(fitted, blank, lit_as_usual, random_light):
    truth = random_light(6)
    means = lit_as_usual(blank(), truth)
    fewer = replace(means, harmonics=np.minimum(means.harmonics, 2), valid=np.arange(len(means.valid)) % 7 != 3)
    expected = settled(fitted, fewer)
    packed, covariance = fitted.sheet.packed[GREEN], fitted.sheet.covariance[GREEN]
    garbage = means.values.copy()
    garbage[~fewer.valid] = np.nan
    garbage[:, 5:] = -3.0
    found = settled(fitted, replace(fewer, values=garbage))
    np.testing.assert_allclose(fitted.sheet.packed[GREEN], packed, atol=1e-9)
    np.testing.assert_allclose(fitted.sheet.covariance[GREEN], covariance, rtol=1e-6, atol=1e-12)
    assert found.chi2 == pytest.approx(expected.chi2)
    # with less to go by it is less certain
    settled(fitted, means)
    assert np.all(np.diagonal(covariance) > np.diagonal(fitted.sheet.covariance[GREEN]))


@pytest.mark.parametrize("blur", [0.0, 0.2, 0.6, 1.0, 2.0])
def test_blur_is_found_from_wherever_it_starts(fitted, blank, lit_as_usual, random_light, blur):
    truth = random_light(7)
    means = lit_as_usual(blank(), truth, blur_variance_px2=blur)
    for start in (0.1, 0.5, 1.2):
        settled(fitted, means, Nuisance.guess(blur_variance_px2=start), frames=5)
        assert fitted.sheet.nuisances[GREEN, 0] == pytest.approx(blur, abs=0.03)
        assert error(fitted, truth) < 0.015


@pytest.mark.parametrize("shift_px", [(0.1, 0.0), (-0.05, 0.12)])
def test_stripes_beside_their_place_are_found_there(fitted, blank, lit_as_usual, random_light, shift_px):
    truth = random_light(11)
    means = lit_as_usual(blank(), truth)
    # what is ahead by a phase lies back by a distance
    values = turned_rows(means.values, -2.0 * np.pi * means.cycles_per_px @ np.array(shift_px))
    settled(fitted, replace(means, values=values), frames=5)
    np.testing.assert_allclose(fitted.sheet.nuisances[GREEN, 3:], shift_px, atol=0.01)
    assert error(fitted, truth) < 0.01


def test_a_picture_of_a_kernel_of_three_pixels_is_sharper_than_a_gaussian(fitted, blank, lit_as_usual, random_light):
    """A blur that is made of pixels is no Gaussian: 1 - 4 a sin^2(pi nu) along each axis, and beyond the second order
    of its logarithm the fourth, (1/12 - a/2) a k^4."""
    truth, means = random_light(12), blank()
    a, cycles = 0.08, means.cycles_per_px * 0.5
    means = replace(means, cycles_per_px=cycles)
    seen = lit_as_usual(means, truth, blur_variance_px2=0.0)
    nu = HARMONIC_OF_ROW[:, None] * cycles[:, None]
    kernel = np.prod(1.0 - 4.0 * a * np.sin(np.pi * nu) ** 2, axis=2)
    settled(fitted, replace(seen, values=seen.values * kernel[..., None]), frames=10)
    blur, sharpness = fitted.sheet.nuisances[GREEN, :2]
    assert blur == pytest.approx(2.0 * a, abs=0.02)
    assert sharpness == pytest.approx(a * (1.0 / 12.0 - a / 2.0), abs=0.002)
    assert error(fitted, truth) < 0.01


def test_nuisance_stays_in_its_range_on_nonsense(fitted, blank):
    means = blank()
    noise = np.random.default_rng(3).normal(size=means.values.shape)
    settled(fitted, replace(means, values=noise))
    blur, sharpness, face, *shift = fitted.sheet.nuisances[GREEN]
    assert 0.0 <= blur <= 6.0
    assert abs(sharpness) <= 0.01
    assert 0.0 <= face <= 1.5
    assert max(np.abs(shift)) <= 0.3
    assert np.all(np.isfinite(fitted.sheet.packed[GREEN]))


def test_paper_that_sticks_to_the_glass_shows_in_the_lower_face(fitted, blank, lit_as_usual, random_light, fresnel):
    truth, means = random_light(8), blank()
    for face in (0.4, 1.0):
        settled(fitted, lit_as_usual(means, truth, mirrored=0.1 * fresnel(means), lower_face=face), frames=6)
        assert fitted.sheet.nuisances[GREEN, 2] == pytest.approx(face, abs=0.03)
        assert error(fitted, truth) < 0.01


def test_without_blocks_the_prior_and_the_first_guess_are_left(fitted, blank, lit_as_usual, random_light):
    means = lit_as_usual(blank(), random_light(9))
    found = settled(fitted, replace(means, valid=np.zeros(len(means.valid), bool)), Nuisance.guess(0.7, 0.9))
    assert np.isnan(found.chi2)
    assert np.isnan(found.unexplained)
    np.testing.assert_allclose(fitted.sheet.packed[GREEN], 0.0, atol=1e-12)
    deviation = prior_stddev(fitted.frequencies, fitted.blocks.white[GREEN] / fitted.white_per_irradiance)
    np.testing.assert_allclose(np.sqrt(np.diagonal(fitted.sheet.covariance[GREEN])), deviation, rtol=1e-9)
    np.testing.assert_array_equal(fitted.sheet.nuisances[GREEN], [0.7, 0.0, 0.9, 0.0, 0.0])
