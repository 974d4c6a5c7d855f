"""What the rows' error bars do when noise, stripes or chroma change."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from arlight.estimation.row_noise import row_noise, row_variance

WHITE, GREEN = 0.5, 1


def variance_of(means, channel=GREEN, white=WHITE, mean_model=0.001):
    return row_variance(means, channel, white, np.full(len(means.valid), mean_model))


def noisy(means, sigma):
    return replace(means, pixel_variance=np.full_like(means.pixel_variance, sigma**2))


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_rows_are_never_better_than_their_pixels(blank, channel):
    for sigma in (0.0, 1e-4, 0.003, 0.02, 0.1):
        means = noisy(blank(), sigma)
        pixels = np.diagonal(means.covariance, axis1=1, axis2=2) * sigma**2
        found = variance_of(means, channel)
        assert np.all(found >= pixels)
        assert np.all(found[:, 0] > 0.0)


def test_noisier_pixels_make_wider_error_bars(blank):
    levels = [variance_of(noisy(blank(), sigma)) for sigma in (0.003, 0.01, 0.03, 0.1)]
    seen = levels[0] > 0.0
    for quieter, louder in pairwise(levels):
        assert np.all(louder >= quieter)
        assert np.all(louder[seen][:1] > quieter[seen][:1])


def test_a_mirrored_lamp_is_worse_than_as_much_noise(blank):
    # noise averages out over a block's pixels, the image of a lamp does not
    means = noisy(blank(), 0.01 * WHITE)
    struck = np.arange(len(means.valid)) % 9 == 0
    lamp = replace(means, pixel_variance=np.where(struck[:, None], (0.1 * WHITE) ** 2, means.pixel_variance))
    everywhere = noisy(means, 0.1 * WHITE)
    quiet, one, all_ = (variance_of(m)[struck, 0] for m in (means, lamp, everywhere))
    assert np.all(one - quiet > 10.0 * (all_ - quiet))


def test_more_pixels_help_until_the_models_own_error_is_left(blank):
    few, many, endless = (variance_of(blank(sigma=0.01, samples=n))[:, 0] for n in (50, 500, 10**9))
    assert np.all(few > many)
    assert np.all(many > endless)
    np.testing.assert_allclose(endless, (0.001 * WHITE) ** 2, rtol=1e-3)
    model = row_variance(blank(samples=10**9), GREEN, WHITE, np.linspace(0.001, 0.02, len(few)))[:, 0]
    assert np.all(np.diff(model) > 0.0)


def test_error_bars_scale_with_the_light(blank):
    means = noisy(blank(), 0.004)
    means.values[:] = np.random.default_rng(1).normal(size=means.values.shape) * 0.1
    means = replace(means, color_trust=np.full(len(means.valid), 0.5))
    brighter = replace(means, values=3.0 * means.values, pixel_variance=9.0 * means.pixel_variance)
    for channel in range(3):
        np.testing.assert_allclose(
            variance_of(brighter, channel, 3.0 * WHITE), 9.0 * variance_of(means, channel), rtol=1e-9
        )


def test_fine_stripes_are_known_less_well(blank):
    means = blank()
    patterned = means.harmonics > 0
    coarse, fine = (
        variance_of(replace(means, cycles_per_px=scale * means.cycles_per_px))[patterned] for scale in (0.5, 2.0)
    )
    assert np.all(fine[:, 1:] > coarse[:, 1:])
    np.testing.assert_array_equal(fine[:, 0], coarse[:, 0])
    # so are the higher harmonics of one block
    assert np.all(np.diff(coarse[:, 1::2], axis=1) > 0.0)


def test_inferred_chroma_widens_red_and_blue_and_not_green(blank):
    means = blank()
    means.values[:, 1:] = 0.1 * (means.harmonics > 0)[:, None, None]
    patterned = means.harmonics > 0
    by_trust = {
        trust: [variance_of(replace(means, color_trust=np.full(len(patterned), trust)), c) for c in range(3)]
        for trust in (1.0, 0.7, 0.0)
    }
    np.testing.assert_array_equal(by_trust[1.0][GREEN], by_trust[0.0][GREEN])
    for channel in (0, 2):
        seen, partly, inferred = (by_trust[trust][channel][patterned] for trust in (1.0, 0.7, 0.0))
        assert np.all(inferred[:, 1:] > partly[:, 1:])
        assert np.all(partly[:, 1:] > seen[:, 1:])
        # a mean is always seen, only more coarsely
        assert np.all(inferred[:, 0] >= seen[:, 0])
        assert np.all(inferred[:, 0] == partly[:, 0])


def test_doubt_of_the_blur_grows_with_what_it_takes(blank):
    means = blank()
    means.values[:, 1:] = 0.1
    mean_model = np.full(len(means.valid), 0.001)
    sharp, soft = (
        row_noise(means, GREEN, WHITE, mean_model, np.full((len(means.valid), 7), transfer)).model
        for transfer in (0.9, 0.2)
    )
    np.testing.assert_array_equal(sharp[:, 0], soft[:, 0])
    assert np.all(soft[:, 1:] > sharp[:, 1:])
