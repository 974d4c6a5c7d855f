"""One channel: the compiled fit against one wide least squares, what is fitted, and what each frame reveals beside."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from arlight.estimation.channel_fit import GREEN, SheetFit
from arlight.estimation.measured_blocks import MeasuredBlocks
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.prior import color_spread, color_stddev, prior_stddev
from arlight.estimation.response import optical_transfer
from arlight.estimation.row_noise import row_noise
from arlight.estimation.stripe_rows import HARMONIC_OF_ROW, turned_rows, usable_rows
from arlight.fourier import pack_real
from arlight.tracking.block_layout import field_blocks

ALIKE = np.array([5.0, *[14.0] * 6])
PRIOR = np.array([0.4, 0.0, 1.0, 0.0, 0.0]), np.array([1.5, 0.005, 0.5, 0.03, 0.03])


@pytest.fixture(scope="module")
def plane(probe):
    """A reflection that is a plane over the sheet, rising from one side to the other."""
    centers = np.array([block.center_mm for block in field_blocks(probe)])
    return np.column_stack([np.ones(len(centers)), centers / 50.0])


@pytest.fixture(scope="module")
def white(probe, random_light):
    """Radiance of clear film on white paper in light as `random_light` makes it."""
    return float(random_light(0)[0, GREEN].real * probe.paper_reflectance * probe.film_transmittance**2 / np.pi)


class Fitted:
    """The compiled fit of a sheet, results in the sheet's own order."""

    def __init__(self, probe, response, basis):
        kinds = [block.kind for block in field_blocks(probe)]
        self.response, self.basis, self.frequencies = response, basis, probe.frequencies
        self.blocks = MeasuredBlocks(
            kinds, response.sequence, probe.slab.refractive_index, response.phasor, response.cosine
        )
        self.mean_model = np.full(len(kinds), 0.001)
        self.white_per_irradiance = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
        self.sheet = SheetFit(
            self.blocks, response, probe.frequencies, basis, self.mean_model, self.white_per_irradiance
        )

    def start(self, means, nuisance=None, count=None):
        count = count or len(self.frequencies)
        self.nuisance = nuisance or Nuisance()
        self.means = means
        self.used = self.sheet.begin(count, self.nuisance)
        self.blocks.gather(means, self.used)
        self.response.fill(self.used)
        self.sheet.forget()
        return self

    def planes(self, name, channel=GREEN):
        """Of a channel, the last axis in the sheet's own order."""
        planes = getattr(self.sheet, name)[channel]
        natural = np.zeros((*planes.shape[:-1], len(self.response.sequence)))
        natural[..., self.response.sequence] = planes[..., : len(self.response.sequence)]
        return natural


@pytest.fixture(scope="module")
def fitted(probe, response, plane):
    return Fitted(probe, response, plane)


@dataclass
class Wide:
    """The same in plain numpy: every row and every unknown, the nuisance among them, in one least squares."""

    packed: np.ndarray
    covariance: np.ndarray
    nuisance: np.ndarray
    lamp: np.ndarray
    weight: np.ndarray
    scale: tuple
    predicted: np.ndarray
    reflection: np.ndarray


def wide_fit(fitted, channel, start, lamp, weight, expected, deviation, extra_pattern=None):
    """One pass from a nuisance (5,), lamps and weights (blocks,), and the coefficients' prior mean and deviation."""
    means, response, level = fitted.means, fitted.response, fitted.blocks.white[channel]
    cycles, scale = (
        means.cycles_per_px,
        np.array(fitted.nuisance.error_scale[channel])[(HARMONIC_OF_ROW > 0).astype(int)],
    )
    wave = 2.0 * np.pi * HARMONIC_OF_ROW[:, None] * cycles[:, None]
    fine = np.sum(np.minimum(np.abs(wave), np.pi) ** 4, axis=2)
    transfer = optical_transfer(cycles, start[0]) * np.exp(start[1] * fine)
    lead = -2.0 * np.pi * cycles @ start[3:]
    design = turned_rows(response.light(means) * transfer[..., None], lead)
    face = turned_rows(response.lower_mirror(means) * transfer, lead)
    mirror = start[2] * face
    mirror[:, 0] += 1.0
    usable = usable_rows(means, transfer)
    noise = row_noise(means, channel, level, fitted.mean_model, transfer)
    fresnel = response_face(fitted)
    # of red and blue only the smoothest part strays from green's pattern
    smooth = fitted.basis if extra_pattern is None else fitted.basis[:, : fitted.sheet.native.coarse - 1]
    basis = smooth * (fresnel / fresnel.mean())[:, None]
    field_deviation = np.full(basis.shape[1], fitted.blocks.native.amplitude[channel])
    field_deviation[0] = level
    if extra_pattern is not None:
        basis, field_deviation = np.column_stack([basis, extra_pattern]), np.append(field_deviation, level)
    count, c, s = len(basis), len(expected), basis.shape[1]
    values = means.values[:, :, channel]
    # rows with the mirrored extra marginalised
    wide, precision, residual_variance = np.zeros((count, 7, c + s)), np.zeros((count, 7, 7)), np.ones((count, 7))
    own = np.zeros((count, 7, 7))
    for b in range(count):
        kept = np.flatnonzero(usable[b])
        covariance = noise.pixels[b] + np.diag(scale * noise.model[b] + noise.inferred[b])
        covariance = (covariance / np.outer(noise.trust[b], noise.trust[b]))[np.ix_(kept, kept)] / weight[b]
        own[b][np.ix_(kept, kept)] = np.linalg.inv(covariance)
        covariance = covariance + lamp[b] * np.outer(mirror[b, kept], mirror[b, kept])
        precision[b][np.ix_(kept, kept)] = np.linalg.inv(covariance)
        model = scale * noise.model[b] / ALIKE
        residual_variance[b] = (np.diag(noise.pixels[b]) + model + noise.inferred[b]) / noise.trust[b] ** 2
        for k, place in enumerate(response.places[b]):
            wide[b, :, place] += design[b, :, k]
        wide[b, :, c:] = np.outer(mirror[b], basis[b])

    def solve(columns, wanted, middle, spread):
        factor = np.zeros((count, 7, 7))
        for b in range(count):
            kept = np.flatnonzero(usable[b])
            factor[b][np.ix_(kept, kept)] = np.linalg.cholesky(precision[b][np.ix_(kept, kept)]).T
        rows = (factor @ columns).reshape(-1, columns.shape[2])
        right = (factor @ np.where(usable, wanted, 0.0)[..., None]).ravel()
        stacked, target = np.vstack([rows, np.diag(1.0 / spread)]), np.concatenate([right, middle / spread])
        solution, *_ = np.linalg.lstsq(stacked, target)
        return solution, np.linalg.inv(stacked.T @ stacked)

    middle = np.concatenate([expected, np.zeros(s)])
    spread = np.concatenate([deviation, field_deviation])
    first, inverse = solve(wide, values, middle, spread)

    def judged(solution, step=None, slopes=None):
        missed = np.where(usable, values, 0.0) - np.where(usable, wide @ solution, 0.0)
        if slopes is not None:
            missed = missed - np.where(usable, slopes @ step, 0.0)
        told = np.einsum("brs,bs->br", own, mirror)
        variance = lamp / (1.0 + lamp * np.sum(told * mirror, axis=1))
        return missed, variance * np.sum(told * missed, axis=1), variance

    _, extra, variance = judged(first)
    field = basis @ first[c:]
    predicted = wide @ first + mirror * extra[:, None]
    mirrored = field + extra**3 / np.maximum(extra**2 + variance, 1e-30)
    quarter = np.zeros_like(predicted)
    quarter[:, 1::2], quarter[:, 2::2] = -predicted[:, 2::2], predicted[:, 1::2]
    slopes = np.stack(
        [-0.5 * np.sum(wave**2, axis=2) * predicted, fine * predicted, face * mirrored[:, None],
         wave[..., 0] * quarter, wave[..., 1] * quarter], axis=2,
    )  # fmt: skip
    both, joint = solve(
        np.concatenate([wide, slopes], axis=2),
        values,
        np.concatenate([middle, PRIOR[0] - start]),
        np.concatenate([spread, PRIOR[1]]),
    )
    solution, step = both[: c + s], both[c + s :]
    missed, extra, variance = judged(solution, step, slopes)
    squared = np.where(usable, (missed - mirror * extra[:, None]) ** 2 / residual_variance, 0.0)
    harmonics = usable[:, 1:].sum(axis=1)
    uneven = np.maximum(means.shading[:, channel] - 0.005 * level, 0.0)
    ordinary = scale[0] * (0.0008 * level) ** 2 + (0.5 * uneven) ** 2
    packed = solution[:c]
    left = precision - precision @ wide @ inverse @ wide.swapaxes(1, 2) @ precision
    return Wide(
        packed=packed,
        covariance=joint[:c, :c] + 1e-4 * np.outer(packed, packed),
        nuisance=start + step,
        lamp=(4.0 * ordinary + extra**2 + variance) / 5.0,
        weight=(8.0 + harmonics) / (8.0 + squared[:, 1:].sum(axis=1)),
        scale=scales_of(scale, noise, ordinary, (0.0008 * level) ** 2, usable, precision, missed, left),
        predicted=wide @ solution + mirror * extra[:, None],
        reflection=basis @ solution[c:] + extra,
    )


def response_face(fitted):
    """(blocks,) Fresnel reflectance toward the camera, by sines and tangents."""
    angle = np.arccos(fitted.means.view_cosine)
    inside = np.arcsin(np.sin(angle) / fitted.blocks.native.index)
    across, along = np.sin(angle - inside) / np.sin(angle + inside), np.tan(angle - inside) / np.tan(angle + inside)
    return 0.5 * (across**2 + along**2)


def scales_of(scale, noise, ordinary, sparkle, usable, precision, missed, left):
    """One minorise-maximise step for the model's variances, means and harmonics apart."""
    model = scale * noise.model / noise.trust**2
    own = noise.variance(np.zeros(7))
    model[:, 0] += scale[0] * sparkle
    own[:, 0] += ordinary - scale[0] * sparkle
    expected = np.diagonal(left, axis1=1, axis2=2) * (own + model / ALIKE)
    pull = np.einsum("brs,bs->br", precision, missed)
    share = model / (own + model)
    seen, result = usable & (noise.trust > 0.5), []
    for rows, robust in ((slice(0, 1), 1.06), (slice(1, None), 0.91)):
        here = seen[:, rows]
        freedom = expected[:, rows][here].sum()
        due = (share * expected)[:, rows][here].sum()
        found = (share * pull**2 * (own + model))[:, rows][here].sum()
        step = np.sqrt(found / (due * robust * (1.0 + np.sqrt(2.0 / (freedom + 1.0)))))
        result.append(np.clip(scale[rows][0] * step, 0.003, 10.0))
    return tuple(result)


def awkward(means, seed):
    """Blocks that err together, that were not seen or not resolved, uneven ones, and chroma that was partly seen."""
    generator = np.random.default_rng(seed)
    count = len(means.valid)
    resolved = np.minimum(means.harmonics, generator.integers(1, 4, count))
    factors = generator.normal(size=(count, 7, 30))
    covariance = factors @ factors.swapaxes(1, 2) / 30 / 400
    valid = generator.random(count) > 0.1
    covariance[~valid] = 0.0
    return replace(
        means,
        covariance=covariance,
        pixel_variance=means.pixel_variance * generator.uniform(0.5, 30.0, (count, 3)),
        shading=generator.uniform(0.0, 0.02, (count, 3)) * valid[:, None],
        harmonics=resolved,
        valid=valid,
        color_trust=np.where(generator.random(count) > 0.3, 1.0, generator.uniform(0.1, 0.9, count)),
    )


def agree(found, expected, scale):
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * scale)


@pytest.mark.parametrize("seed", range(4))
def test_the_fit_is_one_wide_least_squares(fitted, blank, lit_as_usual, random_light, seed):
    camera_mm = np.random.default_rng(seed).uniform([-200, -250, 150], [200, 50, 350])
    means = lit_as_usual(blank(camera_mm, sigma=0.004), random_light(seed), mirrored=0.04, noise_seed=seed)
    scales = ((0.7, 1.6), (1.3, 0.6), (2.0, 1.1))
    nuisance = Nuisance(0.3, 0.8, (0.06, 0.1), scales, 0.0005, (0.02, -0.05))
    fitted.start(awkward(means, seed), nuisance)
    sheet, count = fitted.sheet, len(fitted.mean_model)
    irradiance = fitted.blocks.white[GREEN] / fitted.white_per_irradiance
    deviation = prior_stddev(fitted.frequencies, irradiance)
    lamp, weight = fitted.planes("lamps"), np.random.default_rng(seed).uniform(0.3, 1.2, count)
    sheet.weights[GREEN, :count] = weight[fitted.response.sequence]
    expected = wide_fit(fitted, GREEN, np.array(nuisance.values), lamp, weight, np.zeros_like(deviation), deviation)
    sheet.fit(GREEN)
    compare(fitted, GREEN, expected)
    green = sheet.packed[GREEN].copy()
    share = fitted.blocks.white[0] / fitted.blocks.white[GREEN]
    colorful = color_stddev(
        fitted.frequencies, fitted.blocks.white[0] / fitted.white_per_irradiance, nuisance.color_spread[0]
    )
    pattern = expected.reflection / np.std(expected.reflection)
    doubt = np.hypot(colorful, share * np.sqrt(np.diagonal(expected.covariance)))
    start = sheet.nuisances[GREEN].copy()
    expected = wide_fit(
        fitted, 0, start, share**2 * expected.lamp, expected.weight, share * green, doubt, extra_pattern=pattern
    )
    expected.scale = tuple(max(scale, 1.0) for scale in expected.scale)  # chroma was not stored whole
    sheet.fit(0)
    compare(fitted, 0, expected)
    difference = sheet.packed[0] - green * sheet.packed[0][0] / green[0]
    variance = np.diagonal(sheet.covariance[0])
    spread = color_spread(fitted.frequencies, sheet.packed[0][0], difference, variance, nuisance.color_spread[0])
    assert sheet.spreads[0] == pytest.approx(spread, rel=1e-9)


def compare(fitted, channel, expected):
    sheet = fitted.sheet
    level = fitted.blocks.white[channel]
    agree(sheet.packed[channel], expected.packed, expected.packed[0])
    agree(sheet.covariance[channel], expected.covariance, 1e-3 * np.diagonal(expected.covariance).max())
    agree(sheet.nuisances[channel], expected.nuisance, 1e-2)
    agree(fitted.planes("lamps", channel), expected.lamp, level**2 * 1e-4)
    agree(fitted.planes("weights", channel), expected.weight, 1.0)
    agree(sheet.scales[channel], expected.scale, 1.0)
    agree(fitted.planes("predicted", channel).T, expected.predicted, level)
    agree(fitted.planes("reflection", channel), expected.reflection, level)


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
        settled(fitted, means, Nuisance(blur_variance_px2=start), frames=5)
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
    found = settled(fitted, replace(means, valid=np.zeros(len(means.valid), bool)), Nuisance(0.7, 0.9))
    assert np.isnan(found.chi2)
    assert np.isnan(found.unexplained)
    np.testing.assert_allclose(fitted.sheet.packed[GREEN], 0.0, atol=1e-12)
    deviation = prior_stddev(fitted.frequencies, fitted.blocks.white[GREEN] / fitted.white_per_irradiance)
    np.testing.assert_allclose(np.sqrt(np.diagonal(fitted.sheet.covariance[GREEN])), deviation, rtol=1e-9)
    np.testing.assert_array_equal(fitted.sheet.nuisances[GREEN], [0.7, 0.0, 0.9, 0.0, 0.0])
