"""Dots of a bilevel printer have the design's means and harmonics, and nothing outside the blocks changes."""

import numpy as np
import pytest

from arlight.errors import ProbeError
from arlight.optics import Slab
from arlight.probe import patterns
from arlight.probe.halftone import Tones, even_tone, halftone, render_halftones, require_dots
from arlight.probe.layout import design_probe
from arlight.probe.tone import ToneCurve

DPI = 600
LEAD = 16


@pytest.fixture(scope="module")
def probe():
    return design_probe(1, pixels_per_mm=DPI / 25.4)


@pytest.fixture(scope="module")
def dots(probe):
    return render_halftones(probe)


def stripes(period_dots, angle_rad=0.6, size=290):
    y, x = np.mgrid[:size, :size]
    turns = (x * np.cos(angle_rad) + y * np.sin(angle_rad)) / period_dots
    phase = (2.0 * np.pi * (turns % 1.0)).astype(np.float32)
    return (0.5 + 0.5 * np.cos(phase)).astype(np.float32), phase


def harmonics(image, phase, count=3):
    """Amplitudes of the mean and of harmonics 1 to 3, by least squares."""
    waves = [np.ones_like(phase)] + [f(k * phase) for k in range(1, count + 1) for f in (np.cos, np.sin)]
    basis = np.stack([wave.ravel() for wave in waves]).astype(float)
    fit = np.linalg.solve(basis @ basis.T, basis @ image.ravel().astype(float))
    return np.array([fit[0], *np.hypot(fit[1::2], fit[2::2])])


def floyd_steinberg(target):
    """The textbook's, in plain Python."""
    value, out = target.astype(float), np.zeros(target.shape)
    rows, columns = target.shape
    for y in range(rows):
        for x in range(columns):
            out[y, x] = value[y, x] > 0.5
            error = value[y, x] - out[y, x]
            for dx, dy, share in ((1, 0, 7), (-1, 1, 3), (0, 1, 5), (1, 1, 1)):
                if 0 <= x + dx < columns and y + dy < rows:
                    value[y + dy, x + dx] += error * share / 16.0
    return out


def ordered(target):
    """Bayer's matrix of 8 x 8."""
    matrix = np.zeros((1, 1))
    for _ in range(3):
        matrix = np.block([[4 * matrix, 4 * matrix + 2], [4 * matrix + 3, 4 * matrix + 1]])
    rows, columns = target.shape
    return target > np.tile((matrix + 0.5) / 64.0, (rows // 8 + 1, columns // 8 + 1))[:rows, :columns]


@pytest.mark.parametrize(("period", "bound"), [(10.0, 4e-3), (20.0, 1e-3), (100.0, 1e-3)])
def test_means_and_harmonics_of_the_stripes_are_the_designs(period, bound):
    # the third harmonic of 10 dots lies where the dots' noise is strongest
    target, phase = stripes(period)
    inner = slice(LEAD, -LEAD)
    printed = halftone(target, phase, seed=3, lead=LEAD)
    assert np.abs(harmonics(printed - target[inner, inner], phase[inner, inner])).max() < bound


def test_error_in_band_is_below_that_of_plain_diffusion_and_of_ordered_dither():
    target, phase = stripes(20.0, size=180)
    mine = harmonics(halftone(target, phase) - target, phase)
    plain = harmonics(floyd_steinberg(target) - target, phase)
    assert plain[1] > 0.02
    assert np.linalg.norm(mine) < 0.05 * np.linalg.norm(plain)
    assert np.linalg.norm(mine) < 0.5 * np.linalg.norm(harmonics(ordered(target) - target, phase))


def test_any_part_of_a_block_is_right_too():
    target, phase = stripes(20.0)
    error = halftone(target, phase) - target
    parts = [
        harmonics(error[y : y + 100, x : x + 100], phase[y : y + 100, x : x + 100])
        for y in range(20, 180, 40)
        for x in range(20, 180, 40)
    ]
    # 1e4 dots of variance 1/8 that fell independently would stray by 3.5e-3, and their harmonics by 5e-3
    rms = np.sqrt(np.mean(np.square(parts), axis=0))
    assert rms[0] < 1e-3
    assert np.all(rms[1:] < 3e-3)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.25, 0.5, 0.9, 1.0])
def test_even_tones_keep_their_mean_from_the_first_row_on(share):
    printed = even_tone(share, (120, 160), seed=5)
    assert printed.shape == (120, 160)
    assert printed.mean() == pytest.approx(share, abs=1e-3)
    assert printed[:40].mean() == pytest.approx(share, abs=0.012)
    if share in (0.0, 1.0):
        assert np.all(printed == bool(share))


def test_same_seed_gives_same_dots_and_another_other_ones():
    target, phase = stripes(20.0, size=120)
    first = halftone(target, phase, seed=1)
    np.testing.assert_array_equal(first, halftone(target, phase, seed=1))
    assert np.mean(first != halftone(target, phase, seed=2)) > 0.05


def test_only_grey_is_dithered(probe, dots):
    for name, layer, wanted in (
        ("film", dots.film, patterns.film(probe)),
        ("paper", dots.paper, patterns.paper(probe)),
        ("frame", dots.frame, patterns.frame(probe)[0]),
    ):
        grey = np.zeros(layer.shape, bool)
        for block in probe.blocks:
            if (block.reflectance is not None) == (name == "frame") and block.kind in ("pattern", "wedge"):
                grey[patterns.block_pixels(probe, block)] = True
        np.testing.assert_array_equal(layer[~grey], wanted[~grey] > 0.5)
        assert layer.dtype == bool


def test_every_block_of_a_sheet_is_right(probe, dots):
    for layer, wanted in ((dots.film, patterns.film(probe)), (dots.paper, patterns.paper(probe))):
        for block in probe.blocks:
            if block.kind == "pattern":
                rows, columns = patterns.block_pixels(probe, block)
                phase = patterns.stripe_phase(probe, block, rows, columns)
                error = layer[rows, columns] - wanted[rows, columns]
                assert np.abs(harmonics(error, phase)).max() < 1e-3


def test_film_and_paper_of_a_block_have_dots_of_their_own(probe, dots):
    block = next(b for b in probe.blocks if b.kind == "pattern" and b.phase_deg == 0.0)
    place = patterns.block_pixels(probe, block)
    # the same design in both layers: equal dots would make the block's mean that of one layer alone
    assert np.mean(dots.film[place] != dots.paper[place]) > 0.1


def test_compensated_dots_print_as_the_design():
    probe = design_probe(1, pixels_per_mm=300 / 25.4)
    tone = ToneCurve((0.0, 0.25, 0.5, 0.75, 1.0), (0.04, 0.16, 0.34, 0.6, 1.0))
    layer = render_halftones(probe, Tones(paper=tone)).paper
    block = next(b for b in probe.blocks if b.kind == "pattern")
    rows, columns = patterns.block_pixels(probe, block)
    phase = patterns.stripe_phase(probe, block, rows, columns)
    # dots are what the tone is asked for, by position along the stripes
    place = np.floor(phase / (2.0 * np.pi) * 16).astype(int)
    share = np.array([layer[rows, columns][place == k].mean() for k in range(16)])
    design = np.array([patterns.paper(probe)[rows, columns][place == k].mean() for k in range(16)])
    printed = (tone.print_of(share) - tone.solid) / (1.0 - tone.solid)
    np.testing.assert_allclose(printed, design, atol=0.03)
    assert np.abs(share - design).max() > 0.1


def test_wedge_prints_as_its_reflectances():
    probe = design_probe(1, pixels_per_mm=300 / 25.4)
    tone = ToneCurve((0.0, 0.25, 0.5, 0.75, 1.0), (0.01, 0.12, 0.3, 0.6, 1.0))
    frame = render_halftones(probe, Tones(paper=tone)).frame
    for block in probe.blocks:
        if block.reflectance is not None:
            share = frame[patterns.block_pixels(probe, block)].mean()
            assert float(tone.print_of(share)) == pytest.approx(block.reflectance, abs=3e-3)


def test_too_coarse_a_printer_is_refused_with_what_would_do():
    with pytest.raises(ProbeError, match=r"120 dpi is too coarse for order 5.*149 dpi or more, or .*at most 4"):
        require_dots(Slab(), 5, "matched", 120)
    with pytest.raises(ProbeError, match=r"too coarse for order 1.*thicker glass"):
        require_dots(Slab(0.3), 1, "doubled", 150)
    with pytest.raises(ProbeError, match="too coarse"):
        render_halftones(design_probe(5, pixels_per_mm=5.0))
    require_dots(Slab(), 5, "matched", 300)
