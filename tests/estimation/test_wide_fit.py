"""The compiled fit against one wide least squares in plain numpy, the nuisance among its unknowns."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest

from arlight.estimation.channel_fit import GREEN
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.prior import color_spread, color_stddev, prior_stddev
from arlight.estimation.response import optical_transfer
from arlight.estimation.row_noise import row_noise
from arlight.estimation.stripe_rows import HARMONIC_OF_ROW, turned_rows, usable_rows

ALIKE = np.array([5.0, *[14.0] * 6])
USUAL, SPREAD = np.array([0.4, 0.0, 1.0, 0.0, 0.0]), np.array([1.5, 0.005, 0.5, 0.03, 0.03])


class WideFit:
    """One pass of a channel.

    Args:
        fitted: the sheet, its measurements and its response.
        nuisance: (5,) where it starts; lamp, weight: (blocks,) what it grants.
        expected, deviation: prior of the coefficients.
        pattern: (blocks,) of red and blue: green's reflection.
    """

    def __init__(self, fitted, channel, nuisance, lamp, weight, expected, deviation, pattern=None):
        self.means, self.response, self.channel, self.start = fitted.means, fitted.response, channel, nuisance
        self.lamp, self.weight, self.level = lamp, weight, fitted.blocks.white[channel]
        self.scale = np.array(fitted.nuisance.error_scale[channel])[(HARMONIC_OF_ROW > 0).astype(int)]
        self.count, self.unknown = len(lamp), len(expected)
        self.blur()
        self.noise = row_noise(self.means, channel, self.level, fitted.mean_model, self.transfer)
        fresnel = reflectance(self.means.view_cosine, fitted.blocks.native.index)[:, None]
        # of red and blue only the smoothest part strays from green's pattern
        smooth = fitted.basis if pattern is None else fitted.basis[:, : fitted.sheet.native.coarse - 1]
        self.basis, field = (
            smooth * fresnel / fresnel.mean(),
            np.full(smooth.shape[1], fitted.blocks.native.amplitude[channel]),
        )
        field[0] = self.level
        if pattern is not None:
            self.basis, field = np.column_stack([self.basis, pattern]), np.append(field, self.level)
        self.middle = np.concatenate([expected, np.zeros_like(field)])
        self.deviation = np.concatenate([deviation, field])

    def blur(self):
        """Rows as blur and shift make them."""
        cycles = self.means.cycles_per_px
        self.wave = 2.0 * np.pi * HARMONIC_OF_ROW[:, None] * cycles[:, None]
        self.fine = np.sum(np.minimum(np.abs(self.wave), np.pi) ** 4, axis=2)
        self.transfer = optical_transfer(cycles, self.start[0]) * np.exp(self.start[1] * self.fine)
        lead = -2.0 * np.pi * cycles @ self.start[3:]
        self.design = turned_rows(self.response.light(self.means) * self.transfer[..., None], lead)
        self.face = turned_rows(self.response.lower_mirror(self.means) * self.transfer, lead)
        self.mirror = self.start[2] * self.face
        self.mirror[:, 0] += 1.0
        self.usable = usable_rows(self.means, self.transfer)
        self.values = np.where(self.usable, self.means.values[:, :, self.channel], 0.0)

    @cached_property
    def matrix(self):
        """(blocks, 7, unknown) of coefficients and field."""
        wide = np.zeros((self.count, 7, len(self.middle)))
        for block, places in enumerate(self.response.places):
            for k, place in enumerate(places):
                wide[block, :, place] += self.design[block, :, k]
        wide[:, :, self.unknown :] = self.mirror[:, :, None] * self.basis[:, None, :]
        return np.where(self.usable[..., None], wide, 0.0)

    def precision_with(self, lamp):
        """(blocks, 7, 7) of the usable rows where blocks mirror extras of variance (blocks,) by themselves."""
        precision = np.zeros((self.count, 7, 7))
        for b in range(self.count):
            kept = np.ix_(np.flatnonzero(self.usable[b]), np.flatnonzero(self.usable[b]))
            noise = self.noise.pixels[b] + np.diag(self.scale * self.noise.model[b] + self.noise.inferred[b])
            noise = noise / np.outer(self.noise.trust[b], self.noise.trust[b]) / self.weight[b]
            precision[b][kept] = np.linalg.inv((noise + lamp[b] * np.outer(self.mirror[b], self.mirror[b]))[kept])
        return precision

    @cached_property
    def precision(self):
        return self.precision_with(self.lamp)

    def solve(self, columns, middle, deviation):
        """Least squares of the whitened rows, and of the prior's below them: solution and covariance."""
        factor = np.zeros_like(self.precision)
        for b, usable in enumerate(self.usable):
            kept = np.ix_(np.flatnonzero(usable), np.flatnonzero(usable))
            factor[b][kept] = np.linalg.cholesky(self.precision[b][kept]).T
        rows, right = (factor @ columns).reshape(-1, columns.shape[2]), (factor @ self.values[..., None]).ravel()
        stacked, target = np.vstack([rows, np.diag(1.0 / deviation)]), np.concatenate([right, middle / deviation])
        return np.linalg.lstsq(stacked, target)[0], np.linalg.inv(stacked.T @ stacked)

    @cached_property
    def first(self):
        """Solution at the nuisance at hand, and its covariance."""
        return self.solve(self.matrix, self.middle, self.deviation)

    def extras(self, missed):
        """(blocks,) what each block mirrors by itself, and with which variance that is known."""
        told = np.einsum("brs,bs->br", self.precision_with(np.zeros(self.count)), self.mirror)
        variance = self.lamp / (1.0 + self.lamp * np.sum(told * self.mirror, axis=1))
        return variance * np.sum(told * missed, axis=1), variance

    @cached_property
    def slopes(self):
        """(blocks, 7, 5) change of the rows with the nuisance."""
        solution, _ = self.first
        extra, variance = self.extras(self.values - self.matrix @ solution)
        field = self.basis @ solution[self.unknown :]
        predicted = self.design_rows(solution) + self.mirror * extra[:, None]
        mirrored = field + extra**3 / np.maximum(extra**2 + variance, 1e-30)
        quarter = np.zeros_like(predicted)
        quarter[:, 1::2], quarter[:, 2::2] = -predicted[:, 2::2], predicted[:, 1::2]
        square = -0.5 * np.sum(self.wave**2, axis=2) * predicted
        shift = (self.wave[..., axis] * quarter for axis in range(2))
        return np.stack([square, self.fine * predicted, self.face * mirrored[:, None], *shift], axis=2)

    def design_rows(self, solution):
        """(blocks, 7) rows of light and field, usable or not."""
        lit = np.einsum("brk,bk->br", self.design, np.where(self.known, solution[self.response.places], 0.0))
        return lit + self.mirror * (self.basis @ solution[self.unknown :])[:, None]

    @property
    def known(self):
        return (self.response.places > 0) | (np.arange(self.response.places.shape[1]) == 0)

    @cached_property
    def joint(self):
        """Solution with the step of the nuisance, and the covariance of both."""
        slopes = np.where(self.usable[..., None], self.slopes, 0.0)
        return self.solve(
            np.concatenate([self.matrix, slopes], axis=2),
            np.concatenate([self.middle, USUAL - self.start]),
            np.concatenate([self.deviation, SPREAD]),
        )

    @cached_property
    def found(self):
        """What the compiled fit leaves, by the names it has there."""
        size, packed = len(self.middle), self.joint[0][: self.unknown]
        solution, step = self.joint[0][:size], self.joint[0][size:]
        missed = self.values - self.matrix @ solution - np.where(self.usable, self.slopes @ step, 0.0)
        extra, variance = self.extras(missed)
        squared = np.where(self.usable, (missed - self.mirror * extra[:, None]) ** 2 / self.residual_variance, 0.0)
        covariance = self.joint[1][: self.unknown, : self.unknown]
        return {
            "packed": packed,
            "covariance": covariance + 1e-4 * np.outer(packed, packed),
            "nuisances": self.start + step,
            "lamps": (4.0 * self.ordinary + extra**2 + variance) / 5.0,
            "weights": (8.0 + self.usable[:, 1:].sum(axis=1)) / (8.0 + squared[:, 1:].sum(axis=1)),
            "scales": self.next_scales(missed),
            "predicted": (self.design_rows(solution) + self.mirror * extra[:, None]).T,
            "reflection": self.basis @ solution[self.unknown :] + extra,
        }

    @property
    def residual_variance(self):
        model = self.scale * self.noise.model / ALIKE
        pixels = np.diagonal(self.noise.pixels, axis1=1, axis2=2)
        return np.where(self.usable, (pixels + model + self.noise.inferred) / self.noise.trust**2, 1.0)

    @property
    def ordinary(self):
        """(blocks,) variance of what a block without lamp mirrors by itself."""
        uneven = np.maximum(self.means.shading[:, self.channel] - 0.005 * self.level, 0.0)
        return self.scale[0] * (0.0008 * self.level) ** 2 + (0.5 * uneven) ** 2

    def next_scales(self, missed):
        """One minorise-maximise step for the model's variances, means and harmonics apart."""
        model, own = self.scale * self.noise.model / self.noise.trust**2, self.noise.variance(np.zeros(7))
        sparkle = self.scale[0] * (0.0008 * self.level) ** 2
        model[:, 0] += sparkle
        own[:, 0] += self.ordinary - sparkle
        used = self.precision @ self.matrix
        left = self.precision - used @ self.first[1] @ used.swapaxes(1, 2)
        expected = np.diagonal(left, axis1=1, axis2=2) * (own + model / ALIKE)
        found = np.einsum("brs,bs->br", self.precision, missed) ** 2 * (own + model)
        share, judged, result = model / (own + model), self.usable & (self.noise.trust > 0.5), []
        for rows, robust in ((slice(0, 1), 1.06), (slice(1, None), 0.91)):
            here = judged[:, rows]
            due, seen = ((share * total)[:, rows][here].sum() for total in (expected, found))
            chance = 1.0 + np.sqrt(2.0 / (expected[:, rows][here].sum() + 1.0))
            result.append(np.clip(self.scale[rows][0] * np.sqrt(seen / (due * robust * chance)), 0.003, 10.0))
        return np.array(result)


def reflectance(cosine, index):
    """Of one face of the glass, by sines and tangents."""
    angle = np.arccos(cosine)
    inside = np.arcsin(np.sin(angle) / index)
    across, along = np.sin(angle - inside) / np.sin(angle + inside), np.tan(angle - inside) / np.tan(angle + inside)
    return 0.5 * (across**2 + along**2)


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


def compare(fitted, channel, expected):
    """All results of a channel, to 1e-6 of themselves and of what is usual for their kind."""
    level, light = fitted.blocks.white[channel], expected["packed"][0]
    usual = {
        "packed": light, "covariance": 1e-3 * np.diagonal(expected["covariance"]).max(), "nuisances": 1e-2,
        "lamps": 1e-4 * level**2, "weights": 1.0, "scales": 1.0, "predicted": level, "reflection": level,
    }  # fmt: skip
    for name, scale in usual.items():
        by_block = name in ("lamps", "weights", "predicted", "reflection")
        found = fitted.planes(name, channel) if by_block else getattr(fitted.sheet, name)[channel]
        np.testing.assert_allclose(found, expected[name], rtol=1e-6, atol=1e-6 * scale, err_msg=name)


@pytest.fixture
def begun(fitted, blank, lit_as_usual, random_light):
    """A frame with awkward blocks, and green's fit of it in plain numpy."""

    def begin(seed):
        camera_mm = np.random.default_rng(seed).uniform([-200, -250, 150], [200, 50, 350])
        means = lit_as_usual(blank(camera_mm, sigma=0.004), random_light(seed), mirrored=0.04, noise_seed=seed)
        scales = ((0.7, 1.6), (1.3, 0.6), (2.0, 1.1))
        nuisance = Nuisance.guess(0.3, 0.8, (0.06, 0.1), scales, 0.0005, (0.02, -0.05))
        fitted.start(awkward(means, seed), nuisance)
        weight = np.random.default_rng(seed).uniform(0.3, 1.2, len(means.valid))
        fitted.sheet.weights[GREEN, : len(weight)] = weight[fitted.response.sequence]
        deviation = prior_stddev(fitted.frequencies, fitted.blocks.white[GREEN] / fitted.white_per_irradiance)
        start = nuisance.numbers[:5].copy()
        lamp = fitted.planes("lamps")
        return WideFit(fitted, GREEN, start, lamp, weight, np.zeros_like(deviation), deviation).found

    return begin


@pytest.mark.parametrize("seed", range(4))
def test_greens_fit_is_one_wide_least_squares(fitted, begun, seed):
    expected = begun(seed)
    fitted.sheet.fit(GREEN)
    compare(fitted, GREEN, expected)


@pytest.mark.parametrize("channel", [0, 2])
@pytest.mark.parametrize("seed", range(2))
def test_red_and_blue_start_from_green_and_are_one_wide_least_squares(fitted, begun, seed, channel):
    green, sheet = begun(seed), fitted.sheet
    sheet.fit(GREEN)
    white, spread = fitted.blocks.white, fitted.nuisance.color_spread[channel // 2]
    share = white[channel] / white[GREEN]
    colorful = color_stddev(fitted.frequencies, white[channel] / fitted.white_per_irradiance, spread)
    expected = WideFit(
        fitted,
        channel,
        green["nuisances"],
        share**2 * green["lamps"],
        green["weights"],
        share * green["packed"],
        np.hypot(colorful, share * np.sqrt(np.diagonal(green["covariance"]))),
        pattern=green["reflection"] / np.std(green["reflection"]),
    ).found
    # chroma was not stored whole
    expected["scales"] = np.maximum(expected["scales"], 1.0)
    sheet.fit(channel)
    compare(fitted, channel, expected)
    found, variance = sheet.packed[channel], np.diagonal(sheet.covariance[channel])
    difference = found - sheet.packed[GREEN] * found[0] / sheet.packed[GREEN][0]
    told = color_spread(fitted.frequencies, found[0], difference, variance, spread)
    assert sheet.spreads[channel] == pytest.approx(told, rel=1e-9)
