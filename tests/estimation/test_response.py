"""Rows of the blocks against the paper's closed forms, and against rays traced through film, glass and paper."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, uniform_filter

from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.probe.design import Block, Probe

GLASS, INDEX = 2.44, 1.52
PERIOD = 2 * GLASS / np.sqrt(INDEX**2 - 1)
PAPER, FILM = 0.85, 0.92
UP = np.array([0.0, 0.0, 1.0])
UNPATTERNED = ("clear_white", "clear_black", "black_white", "black_black")


def probe_of(design):
    """Every phase of some frequencies of all directions and orders, then the unpatterned regions."""
    frequencies = [(0, 1), (1, 0), (-2, 1), (1, 2), (3, 4), (-3, 1), (5, 0)]
    phases = (0.0, 90.0, 180.0, 270.0) if design == "matched" else (0.0, 90.0)
    kinds = [("pattern", n, tau) for n in frequencies for tau in phases] + [(kind, None, None) for kind in UNPATTERNED]
    blocks = tuple(Block(i, kind, (0.0, 0.0), 12.0, 6.0, n, tau) for i, (kind, n, tau) in enumerate(kinds))
    return Probe(design, 5, (160.0, 160.0), 20, GLASS, INDEX, "DICT_4X4_50", (), blocks, PAPER, FILM)


def random_directions(generator, count, least_cosine):
    cosine = generator.uniform(least_cosine, 1, count)
    azimuth = generator.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)


def to_the_side(w):
    """From the paper point to the film point of the rays toward w [mm]: Snell's law for vectors."""
    cosine = w @ UP
    inside = w / INDEX + (np.sqrt(1 - (1 - cosine**2) / INDEX**2) - cosine / INDEX)[..., None] * UP
    return GLASS * inside[..., :2] / inside[..., 2:]


def face(cosine):
    """Unpolarised reflectance of one face by sines and tangents."""
    angle = np.arccos(np.minimum(cosine, 1 - 1e-12))
    inside = np.arcsin(np.sin(angle) / INDEX)
    across = np.sin(angle - inside) / np.sin(angle + inside)
    along = np.tan(angle - inside) / np.tan(angle + inside)
    return 0.5 * (across**2 + along**2)


def means_seen(probe, view):
    """What the response reads of the blocks' measurements: one direction toward the viewer."""
    n = np.array([block.frequency or (0, 0) for block in probe.blocks])
    phasor = np.exp(-2j * np.pi * (n @ to_the_side(view)) / PERIOD)
    return SimpleNamespace(view_phasor=phasor, view_cosine=np.full(len(n), view[2]))


class Sheet:
    """One block's layers as printed, over all the plane, under a few distant lamps."""

    def __init__(self, design, block, lamps, received):
        self.design, self.block = design, block
        self.crossings, self.received = to_the_side(lamps), received

    def phase(self, place):
        return 2 * np.pi * (place @ np.array(self.block.frequency or (0, 0), float)) / PERIOD

    def film(self, place):
        if self.block.kind != "pattern":
            return np.full(place.shape[:-1], FILM * self.block.kind.startswith("clear"))
        wave = np.cos(self.phase(place)) if self.design == "matched" else -np.sin(self.phase(place))
        return FILM * (1 + wave) / 2

    def paper(self, place):
        if self.block.kind != "pattern":
            return np.full(place.shape[:-1], PAPER * self.block.kind.endswith("white"))
        tau = np.radians(self.block.phase_deg)
        phase = self.phase(place)
        return PAPER * (1 + (np.cos(phase + tau) if self.design == "matched" else np.sin(2 * phase + tau))) / 2

    def irradiance(self, place):
        """Light on the paper straight from the lamps."""
        return sum(r * self.film(place + side) for r, side in zip(self.received, self.crossings, strict=True))

    def coefficients(self):
        """L_0, Re L_n and Im L_n: the lamps summed one by one."""
        turn = self.phase(self.crossings)
        return np.array([self.received.sum(), self.received @ np.cos(turn), -self.received @ np.sin(turn)])

    def bounced(self, place, generator, bounces=5):
        """One random path for each paper point: its light after one and more reflections in the glass."""
        place, share, total = place.copy(), np.ones(len(place)), np.zeros(len(place))
        for _ in range(bounces):
            direction = random_cosine_directions(generator, len(place))
            reflectance = face(direction[:, 2])
            upper = generator.random(len(place)) < 0.5
            side = to_the_side(direction)
            twice = (1 - reflectance) ** 2 * self.film(place + side) ** 2
            share *= 2 * reflectance * np.where(upper, twice, 1.0)
            place += np.where(upper[:, None], 2 * side, 0.0)
            share *= self.paper(place)
            total += share * self.irradiance(place)
        return total


def random_cosine_directions(generator, count):
    sine = np.sqrt((np.arange(count) + generator.random(count)) / count)
    azimuth = generator.uniform(0, 2 * np.pi, count)
    w = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1 - sine**2)], axis=1)
    return generator.permutation(w)


def rows_of(radiance, phase):
    """Mean, then twice the means with cosine and sine of three harmonics (..., 7)."""
    waves = [np.ones_like(phase)] + [2 * wave(m * phase) for m in (1, 2, 3) for wave in (np.cos, np.sin)]
    return np.stack([radiance * wave for wave in waves], axis=-1)


def pixels_over_a_period(generator, count):
    """Film points on a grid over P x P, shifted at random: whole periods of every frequency."""
    axis = np.arange(count) * PERIOD / count
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return grid + generator.uniform(0, PERIOD, 2)


def case_of(design, seed):
    generator = np.random.default_rng(seed)
    lamps, received = random_directions(generator, 5, np.cos(np.radians(70))), generator.uniform(0.2, 2, 5)
    view = random_directions(generator, 1, np.cos(np.radians(70)))[0]
    return generator, probe_of(design), lamps, received, view


def through_the_glass(view):
    return (1 - face(view[2])) / (1 + face(view[2]))


@pytest.mark.parametrize("design", ["matched", "doubled"])
@pytest.mark.parametrize("seed", range(4))
def test_without_bounces_rows_are_traced_light(design, seed):
    generator, probe, lamps, received, view = case_of(design, seed)
    rows = BlockResponse(probe, bounces=False).light(means_seen(probe, view))
    assert rows.shape == (len(probe.blocks), 7, 3)
    for block, row in zip(probe.blocks, rows, strict=True):
        sheet = Sheet(design, block, lamps, received)
        pixel = pixels_over_a_period(generator, 48)
        on_paper = pixel - to_the_side(view)
        scattered = sheet.film(pixel) * sheet.paper(on_paper) * sheet.irradiance(on_paper) / np.pi
        expected = rows_of(scattered * through_the_glass(view), sheet.phase(pixel)).mean(axis=0)
        if block.kind != "pattern":  # no pattern, no stripes
            expected[1:] = 0
        np.testing.assert_allclose(row @ sheet.coefficients(), expected, atol=1e-12)


@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_without_bounces_means_are_the_closed_forms(design):
    _, probe, lamps, received, view = case_of(design, 10)
    rows = BlockResponse(probe, bounces=False).light(means_seen(probe, view))
    for block, row in zip(probe.blocks, rows, strict=True):
        if block.kind != "pattern":
            continue
        sheet = Sheet(design, block, lamps, received)
        a, b, tau = sheet.phase(to_the_side(lamps)), sheet.phase(to_the_side(view)), np.radians(block.phase_deg)
        if design == "matched":
            response = (1 + np.cos(a - tau) / 2 + np.cos(a - b) / 2 + np.cos(b - tau) / 2) / 8
        else:
            response = (1 + np.cos(a - b) / 2 - np.sin(tau - a - b) / 4) / 8
        expected = PAPER * FILM**2 / np.pi * through_the_glass(view) * (received @ response)
        assert row[0] @ sheet.coefficients() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("design", "number", "seed"),
    [
        ("matched", 4, 20),
        ("matched", 9, 21),
        ("matched", 18, 22),
        ("doubled", 2, 23),
        ("doubled", 5, 24),
        ("matched", 28, 25),
    ],
)
def test_with_bounces_rows_are_traced_light(design, number, seed):
    generator, probe, lamps, received, view = case_of(design, seed)
    block = probe.blocks[number]
    sheet = Sheet(design, block, lamps, received)
    means = means_seen(probe, view)
    more, less = (
        BlockResponse(probe, bounces=bounces, echoes=False).light(means)[number] @ sheet.coefficients()
        for bounces in (True, False)
    )
    batches = []
    for _ in range(16):
        pixel = pixels_over_a_period(generator, 80)
        on_paper = pixel - to_the_side(view)
        bounced = sheet.film(pixel) * sheet.paper(on_paper) * sheet.bounced(on_paper, generator) / np.pi
        batches.append(rows_of(bounced * through_the_glass(view), sheet.phase(pixel)).mean(axis=0))
    expected, noise = np.mean(batches, axis=0), np.std(batches, axis=0, ddof=1) / 4
    patterned = slice(0, 7 if block.kind == "pattern" else 1)
    found = (more - less)[patterned]
    assert np.all(abs(found - expected[patterned]) < 4.5 * noise[patterned] + 1e-4 * less[0])
    # the trace is fine enough to see five per cent of what bounces add, which is worth adding
    assert noise[0] < 0.0125 * expected[0]
    assert 0.04 * less[0] < expected[0] < 0.2 * less[0]


@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_lower_face_mirrors_through_the_film_twice(design):
    generator, probe, lamps, received, view = case_of(design, 30)
    rows = BlockResponse(probe).lower_mirror(means_seen(probe, view))
    inside = 1 - face(view[2])
    for block, row in zip(probe.blocks, rows, strict=True):
        sheet = Sheet(design, block, lamps, received)
        pixel = pixels_over_a_period(generator, 48)
        # down from the pixel, up again as far on the other side; relative to the upper face's mirror image
        seen = inside**2 * sheet.film(pixel) * sheet.film(pixel - 2 * to_the_side(view))
        expected = rows_of(seen, sheet.phase(pixel)).mean(axis=0)
        if block.kind != "pattern":
            expected[1:] = 0
        np.testing.assert_allclose(row, expected, atol=1e-12)


@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_turning_sheet_light_and_view_together_changes_nothing(design):
    """A quarter turn takes frequency (0, 1) to (-1, 0), which is (1, 0) seen with the opposite phase."""
    generator = np.random.default_rng(40)
    view = random_directions(generator, 1, 0.4)[0]
    turned = np.array([view[1], -view[0], view[2]])  # a quarter turn back: y becomes x
    probe = probe_of(design)
    response = BlockResponse(probe)
    phases = len({block.phase_deg for block in probe.blocks} - {None})
    upright, across = response.light(means_seen(probe, view))[:phases], response.light(means_seen(probe, turned))
    # the directions over which the horizon's light is predicted are not symmetrical themselves
    np.testing.assert_allclose(upright, across[phases : 2 * phases], atol=1e-7)


def test_opposite_phases_of_the_matched_design_add_up_to_white_paper():
    _, probe, _, _, view = case_of("matched", 41)
    means = BlockResponse(probe, bounces=False).light(means_seen(probe, view))[:, 0]
    np.testing.assert_allclose(means[0:28:4] + means[2:28:4], means[1:28:4] + means[3:28:4], atol=1e-15)


def with_phasor(probe, phasor):
    return SimpleNamespace(view_phasor=np.full(len(probe.blocks), phasor), view_cosine=np.full(len(probe.blocks), 0.8))


@pytest.mark.parametrize("design", ["matched", "doubled"])
@pytest.mark.parametrize("width", [0.05, 0.2, 0.35])
def test_rows_are_means_over_a_spread_of_views(design, width):
    """The phase of the view spread as over a square block seen slantwise: the sum of two uniform spreads."""
    probe = probe_of(design)
    response = BlockResponse(probe)
    samples = (np.arange(20) + 0.5) / 20 - 0.5
    phases = np.exp(-1j * (0.9 + width * (samples[:, None] + 0.6 * samples[None, :]).ravel()))
    for rows_seen in (response.light, response.lower_mirror):
        expected = np.mean([rows_seen(with_phasor(probe, phase)) for phase in phases], axis=0)
        found = rows_seen(with_phasor(probe, phases.mean()))
        np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_views_without_any_common_direction_are_finite():
    probe = probe_of("matched")
    response = BlockResponse(probe)
    nothing = response.light(with_phasor(probe, 0j))
    assert np.all(np.isfinite(nothing))
    # what depends on the view's phase is gone: it is the same for the least of phasors, whatever its phase
    for phasor in (1e-30j, -1e-30):
        np.testing.assert_allclose(response.light(with_phasor(probe, phasor)), nothing, atol=1e-6)
        assert np.all(np.isfinite(response.lower_mirror(with_phasor(probe, phasor))))


@pytest.mark.parametrize("variance", [0.0, 0.3, 1.5])
def test_optical_transfer_is_what_pixels_and_blur_leave_of_a_cosine(variance):
    size, fine = 32, 32
    u, v = 3, -2  # cycles over the picture
    x, y = np.meshgrid(*[np.arange(size * fine) / (size * fine)] * 2)
    phase = 2 * np.pi * (u * x + v * y)
    sharp = sum(np.cos(m * phase) for m in (1, 2, 3))
    blurred = gaussian_filter(sharp, np.sqrt(variance) * fine, mode="wrap") if variance else sharp
    spectrum = np.fft.fft2(uniform_filter(blurred, fine, mode="wrap"))
    left = [2 * abs(spectrum[m * v, m * u]) / sharp.size for m in (1, 2, 3)]
    found = optical_transfer(np.array([[u, v], [0, 0]]) / size, variance)
    np.testing.assert_allclose(found[0], [1, *np.repeat(left, 2)], atol=5e-4)
    np.testing.assert_array_equal(found[1], 1)
