"""Lighting from measurements that the response itself made: what went in comes out, whatever the film mirrors."""

from dataclasses import fields, replace

import numpy as np
import pytest

from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.prior import prior_stddev
from arlight.fourier import pack_real
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import BlockMeans

COLORS = {"neutral": (1.0, 1.0, 1.0), "amber": (1.0, 0.55, 0.2), "blue": (0.3, 0.6, 1.0)}


@pytest.fixture(scope="module")
def estimator(probe):
    return LightingEstimator(probe)


@pytest.fixture(scope="module")
def centers(probe):
    return np.array([block.center_mm for block in field_blocks(probe)])


def relative_error(estimate, truth):
    """(k, 3) error over each channel's own L_0."""
    return np.abs(estimate.lighting.coefficients - truth) / truth[0].real


def settled(estimator, means, frames=8):
    """The estimate of the last of several equal frames, each starting from the one before."""
    nuisance = None
    for _ in range(frames):
        estimate = estimator.estimate(means, 0.0, nuisance)
        nuisance = estimate.nuisance
    return estimate


def only(means, kept):
    """The measurements with all other blocks unseen, as a meter reports them."""
    kept = np.asarray(kept)
    cleared = {name: getattr(means, name).copy() for name in ("values", "covariance", "pixel_variance", "samples")}
    for values in cleared.values():
        values[~kept] = 0
    return replace(means, valid=means.valid & kept, harmonics=np.where(kept, means.harmonics, 0), **cleared)


@pytest.mark.parametrize("color", COLORS)
@pytest.mark.parametrize("seed", range(3))
def test_light_without_noise_is_recovered(estimator, blank, lit, random_light, color, seed):
    truth = random_light(seed, COLORS[color])
    estimate = estimator.estimate(lit(blank(), truth), 1.25)
    error = relative_error(estimate, truth)
    assert error.max() < 0.01
    assert np.sqrt(np.mean(error**2)) < 0.003
    # and no farther off than stated
    assert np.all(error * truth[0].real < estimate.lighting.stddev)
    assert estimate.lighting.time_s == 1.25
    assert estimate.lighting.chi2 < 0.1


@pytest.mark.parametrize("camera_mm", [(0.0, -20.0, 300.0), (150.0, 200.0, 150.0), (-300.0, -40.0, 110.0)])
def test_it_does_not_matter_from_where_the_sheet_is_seen(estimator, blank, lit, random_light, camera_mm):
    truth = random_light(4)
    error = relative_error(estimator.estimate(lit(blank(camera_mm), truth), 0.0), truth)
    assert error.max() < 0.01


@pytest.mark.parametrize("gain", [0.2, 3.0])
def test_estimates_scale_with_the_light(estimator, blank, lit, random_light, gain):
    means = lit(blank(), random_light(5), noise_seed=1)
    brighter = replace(
        means,
        values=gain * means.values,
        pixel_variance=gain**2 * means.pixel_variance,
        shading=gain * means.shading,
    )
    one, other = estimator.estimate(means, 0.0), estimator.estimate(brighter, 0.0)
    level = np.abs(gain * one.lighting.coefficients).max()
    np.testing.assert_allclose(other.lighting.coefficients, gain * one.lighting.coefficients, atol=1e-3 * level)
    np.testing.assert_allclose(other.lighting.stddev, gain * one.lighting.stddev, rtol=0.02)
    assert other.nuisance.blur_variance_px2 == pytest.approx(one.nuisance.blur_variance_px2, rel=0.01)


def test_each_channel_keeps_its_own_scale(estimator, blank, lit, random_light):
    truth = random_light(6)
    gains = np.array([0.4, 1.0, 2.5])
    means = lit(blank(), truth)
    tinted = replace(means, values=gains * means.values, pixel_variance=gains**2 * means.pixel_variance)
    one, other = estimator.estimate(means, 0.0).lighting, estimator.estimate(tinted, 0.0).lighting
    np.testing.assert_allclose(other.coefficients / gains, one.coefficients, atol=2e-3 * truth[0].real.max())


def test_lamps_mirrored_by_some_blocks_do_not_matter(estimator, blank, lit, random_light, centers):
    truth = random_light(7)
    clean = estimator.estimate(lit(blank(), truth), 0.0).lighting
    for seed in range(4):
        generator = np.random.default_rng(seed)
        lamps = np.zeros((len(centers), 3))
        # from a glint to a lamp brighter than the paper, in its own colour, in the film and the glass behind it
        struck = generator.choice(len(centers), 8, replace=False)
        lamps[struck] = generator.uniform(0.03, 0.8, (8, 1)) * generator.uniform(0.7, 1.0, (8, 3))
        means = lit(blank(), truth, mirrored=lamps)
        estimate = estimator.estimate(replace(means, shading=0.3 * lamps), 0.0)
        error = relative_error(estimate, truth)
        assert error.max() < 0.015
        assert np.sqrt(np.mean(error**2)) < 0.004
        assert np.all(estimate.lighting.stddev > 0.9 * clean.stddev)


def test_the_mirrored_room_is_told_from_the_light(estimator, blank, lit, random_light, centers, fresnel):
    truth = random_light(8)
    x, y = centers.T / 50.0
    room = 0.03 + 0.012 * x + 0.01 * np.sin(1.3 * y + 0.4)
    mirrored = fresnel(blank()) * room[:, None] * np.array([1.0, 0.8, 0.6])
    estimate = estimator.estimate(lit(blank(), truth, mirrored=mirrored), 0.0)
    error = relative_error(estimate, truth)
    assert error.max() < 0.01
    np.testing.assert_allclose(estimate.reflection, mirrored, atol=0.1 * np.ptp(mirrored))


def test_blur_and_lower_face_are_found_from_the_stripes(estimator, blank, lit, random_light, fresnel):
    truth = random_light(9)
    for blur, face in [(0.1, 1.0), (0.9, 0.7), (1.6, 1.0)]:
        means = lit(blank(), truth, mirrored=0.05 * fresnel(blank()), blur_variance_px2=blur, lower_face=face)
        estimate = settled(estimator, means, frames=16)
        assert estimate.nuisance.blur_variance_px2 == pytest.approx(blur, abs=0.02)
        assert estimate.nuisance.lower_face == pytest.approx(face, abs=0.06)
        # what blur has taken from the finest stripes is not made up for
        assert np.all(relative_error(estimate, truth) * truth[0].real < estimate.lighting.stddev)
        assert relative_error(estimate, truth).max() < 0.03


def test_the_order_of_the_blocks_does_not_matter(probe, estimator, blank, lit, random_light):
    means = lit(blank(), random_light(10, COLORS["amber"]), noise_seed=3)
    order = np.random.default_rng(11).permutation(len(means.valid))
    shuffled_probe = replace(probe, blocks=tuple(field_blocks(probe)[i] for i in order))
    shuffled = BlockMeans(**{f.name: getattr(means, f.name)[order] for f in fields(means)})
    one = estimator.estimate(means, 0.0)
    other = LightingEstimator(shuffled_probe).estimate(shuffled, 0.0)
    np.testing.assert_allclose(other.lighting.coefficients, one.lighting.coefficients, atol=1e-6)
    np.testing.assert_allclose(other.lighting.covariance, one.lighting.covariance, atol=1e-9)
    np.testing.assert_allclose(other.reflection, one.reflection[order], atol=1e-6)


def assert_sound(lighting):
    assert np.all(np.isfinite(lighting.coefficients))
    assert np.all(np.isfinite(lighting.covariance))
    np.testing.assert_allclose(lighting.covariance, lighting.covariance.swapaxes(1, 2), rtol=1e-6, atol=1e-12)
    assert np.linalg.eigvalsh(lighting.covariance).min() > 0.0


def test_without_any_block_nothing_is_claimed(probe, estimator, blank, lit, random_light):
    means = lit(blank(), random_light(12))
    full = estimator.estimate(means, 0.0).lighting
    estimate = estimator.estimate(only(means, np.zeros(len(means.valid), bool)), 0.0)
    assert_sound(estimate.lighting)
    assert np.isnan(estimate.lighting.chi2)
    assert np.all(estimate.lighting.stddev[0] > 1.0)
    assert np.all(estimate.lighting.stddev[1:] > 10.0 * full.stddev[1:])
    # green is as uncertain as natural light of some brightness is before it is seen
    ratio = np.sqrt(np.diagonal(estimate.lighting.covariance[1])) / prior_stddev(probe.frequencies, 1.0)
    assert np.ptp(ratio[1:]) < 1e-6
    assert np.all(np.isfinite(estimate.stripes))
    assert np.all(np.isfinite(estimate.reflection))


@pytest.mark.parametrize("kind", ["pattern", "clear_white", "clear_black", "black_black"])
def test_one_block_tells_no_more_than_it_knows(probe, estimator, blank, lit, random_light, kind):
    truth = random_light(13)
    means = lit(blank(), truth)
    block = next(i for i, b in enumerate(field_blocks(probe)) if b.kind == kind)
    nothing = estimator.estimate(only(means, np.zeros(len(means.valid), bool)), 0.0).lighting
    full = estimator.estimate(means, 0.0).lighting
    estimate = estimator.estimate(only(means, np.arange(len(means.valid)) == block), 0.0)
    assert_sound(estimate.lighting)
    assert np.all(estimate.lighting.stddev > full.stddev)
    own = next(
        (k for k, n in enumerate(probe.frequencies.tolist()) if tuple(n) == field_blocks(probe)[block].frequency), 0
    )
    others = [k for k in range(1, len(truth)) if k != own]
    relative = estimate.lighting.stddev[others, 1] / nothing.stddev[others, 1]
    assert np.ptp(relative) < 1e-3 * relative.max()


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
def test_a_hidden_part_of_the_sheet_costs_certainty_not_correctness(estimator, blank, lit, random_light, share):
    truth = random_light(14)
    means = lit(blank(), truth, noise_seed=4)
    kept = np.random.default_rng(15).random(len(means.valid)) > share
    full, part = estimator.estimate(means, 0.0).lighting, estimator.estimate(only(means, kept), 0.0).lighting
    assert_sound(part)
    assert np.all(part.stddev[:, 1] > 0.95 * full.stddev[:, 1])
    deviation = np.abs(part.coefficients - truth) / part.stddev
    assert np.sqrt(np.mean(deviation**2)) < 1.5


def test_black_pictures_are_black(estimator, blank):
    estimate = estimator.estimate(blank(), 0.0)
    assert_sound(estimate.lighting)
    assert np.abs(estimate.lighting.coefficients).max() < 0.01
    assert np.abs(estimate.stripes).max() < 0.01


def test_more_pixels_make_the_estimate_more_certain(estimator, blank, lit, random_light):
    truth = random_light(16)
    few, many = (estimator.estimate(lit(blank(sigma=0.006, samples=n), truth), 0.0).lighting for n in (40, 1000))
    assert np.all(many.stddev < few.stddev)
    assert_sound(few)
    assert_sound(many)


@pytest.mark.parametrize("sigma", [0.005, 0.03])
@pytest.mark.parametrize("color", COLORS)
def test_errors_of_noisy_pixels_are_as_large_as_stated(estimator, blank, lit, random_light, color, sigma):
    truth = random_light(17, COLORS[color])
    clean = blank(sigma=sigma)
    nuisance, squares, chi2 = None, [], []
    for seed in range(24):
        estimate = estimator.estimate(lit(clean, truth, noise_seed=seed), 0.0, nuisance)
        nuisance = estimate.nuisance
        if seed < 12:
            continue
        wrong = pack_real(estimate.lighting.coefficients - truth)
        covariance = estimate.lighting.covariance
        squares.append([e @ np.linalg.solve(c, e) / len(e) for e, c in zip(wrong.T, covariance, strict=True)])
        chi2.append(estimate.lighting.chi2)
    # 25 unknowns and 12 frames: 300 squares, whose mean is known to 8 %
    assert 0.65 < np.mean(squares, axis=0)[1] < 1.3
    assert np.all(np.mean(squares, axis=0) < 1.3)
    assert np.mean(chi2) < 1.3


def test_expected_stripes_are_the_measured_ones_in_one_colour(estimator, blank, lit, random_light, fresnel):
    mirrored = fresnel(blank()) * np.array([0.01, 0.02, 0.03])
    means = lit(blank(), random_light(18, COLORS["amber"]), mirrored=mirrored, blur_variance_px2=0.5)
    stripes = settled(estimator, means).stripes
    assert stripes.shape == means.values.shape
    level = means.values[:, 0].max(axis=0)
    assert np.all(np.abs(stripes[:, 0] - means.values[:, 0]) < 0.01 * level)
    assert np.all(np.abs(stripes[..., 1] - means.values[..., 1]) < 0.01 * level[1])
    # red and blue stripes have green's shape: all harmonics in one ratio
    for channel in (0, 2):
        cross = stripes[:, 1:, channel, None] * stripes[:, None, 1:, 1]
        np.testing.assert_allclose(cross, np.swapaxes(cross, 1, 2), atol=1e-9)


def test_the_last_frames_blur_is_a_better_start_than_none(estimator, blank, lit, random_light):
    truth = random_light(19)
    means = lit(blank(), truth, blur_variance_px2=1.5)
    known = settled(estimator, means).nuisance
    # a frame after the next starts with what it ends with
    again = estimator.estimate(means, 0.0, known).nuisance
    assert again.blur_variance_px2 == pytest.approx(known.blur_variance_px2, abs=2e-3)
    assert again.lower_face == pytest.approx(known.lower_face, abs=2e-3)
    assert again.color_spread == pytest.approx(known.color_spread, rel=0.1)


def test_measurements_are_left_as_they_were(estimator, blank, lit, random_light):
    means = lit(blank(), random_light(20))
    copies = {f.name: getattr(means, f.name).copy() for f in fields(means)}
    estimator.estimate(means, 0.0)
    for name, copy in copies.items():
        np.testing.assert_array_equal(getattr(means, name), copy)


def test_more_iterations_change_little_once_a_clip_has_begun(probe, blank, lit, random_light):
    truth = random_light(23)
    few, many = LightingEstimator(probe), LightingEstimator(probe, iterations=6)
    errors = []
    for estimator in (few, many):
        nuisance, squares = None, []
        for seed in range(12):
            lamps = np.zeros((len(blank().valid), 3))
            # a lamp that wanders over the sheet
            lamps[5 * seed : 5 * seed + 3] = 0.3
            means = lit(blank(sigma=0.004), truth, mirrored=lamps, noise_seed=seed)
            estimate = estimator.estimate(means, 0.0, nuisance)
            nuisance = estimate.nuisance
            squares.append(relative_error(estimate, truth) ** 2)
        errors.append(np.sqrt(np.mean(squares[2:])))
    assert errors[0] < 1.1 * errors[1]


def test_a_frame_of_nonsense_does_not_spoil_the_next(estimator, blank, lit, random_light):
    truth = random_light(24)
    good, spoilt = lit(blank(), truth), lit(blank(), truth)
    spoilt.values[7] = np.nan
    nuisance = estimator.estimate(spoilt, 0.0, settled(estimator, good, 3).nuisance).nuisance
    after = estimator.estimate(good, 0.0, nuisance)
    assert relative_error(after, truth).max() < 0.01
    wild = replace(good, values=1e3 * np.random.default_rng(1).normal(size=good.values.shape))
    for _ in range(4):
        estimate = estimator.estimate(wild, 0.0, nuisance)
        nuisance = estimate.nuisance
        assert np.all(np.isfinite(estimate.lighting.covariance))
    assert relative_error(settled(estimator, good, 4), truth).max() < 0.01


@pytest.fixture(scope="module")
def found(estimator, blank):
    return estimator.estimate(blank(), 0.0)


@pytest.mark.parametrize("overshoot", [0.0, 1.0, 1.5, 2.5])
def test_a_guide_that_is_overshot_settles(found, overshoot):
    """Each frame's stripes stray from the true ones to the other side of where their guide did, and further."""
    true, generator = found.stripes, np.random.default_rng(5)
    guide = true + generator.normal(scale=0.1, size=true.shape)
    began = np.abs(guide - true).max()
    for _ in range(30):
        guide = replace(found, stripes=true - overshoot * (guide - true)).guiding_on(None, guide).stripes
    assert np.abs(guide - true).max() < 1e-2 * began


def test_only_blocks_that_were_measured_change_what_guides(found):
    generator = np.random.default_rng(6)
    last, measured = generator.normal(size=found.stripes.shape), generator.random(len(found.stripes)) < 0.5
    guide = found.guiding_on(measured, last).stripes
    np.testing.assert_array_equal(guide[~measured], last[~measured])
    between = (guide - last)[measured] / (found.stripes - last)[measured]
    assert np.all((between > 0.0) & (between < 1.0))
    np.testing.assert_array_equal(found.guiding_on(measured, found.stripes).stripes, found.stripes)
