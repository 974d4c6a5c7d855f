"""Printed and laid layers: halftones keep the mean, registration moves what it says, the frame covers its part."""

import numpy as np
import pytest

from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.layout import design_probe
from arlight.probe.patterns import film_transmittance
from arlight.tracking.block_layout import field_blocks
from arlight.validation.assembled_layers import assembled_layers, halftoned

PROBE = design_probe(order=1)
PATTERN = next(block for block in field_blocks(PROBE) if block.frequency == (1, 0))


def window(layers, image, block):
    """Samples of a block's window."""
    x, y = block.center_mm
    column = round((x - layers.first_mm[0]) * layers.per_mm)
    row = round((layers.first_mm[1] - y) * layers.per_mm)
    half = round(block.window_mm / 2 * layers.per_mm)
    return image[row - half : row + half, column - half : column + half]


def phase_of(layers, image, block):
    """Phase of the stripes across a block at the origin, and their amplitude."""
    part = window(layers, image, block).mean(axis=0)
    x, _ = block.center_mm
    column = round((x - layers.first_mm[0]) * layers.per_mm)
    half = len(part) // 2
    x_mm = layers.first_mm[0] + (np.arange(column - half, column + half)) / layers.per_mm
    wave = np.mean(part * np.exp(-2j * np.pi * x_mm / PROBE.slab.period_mm))
    return np.angle(wave), 2 * np.abs(wave)


@pytest.mark.parametrize("tone", [0.05, 0.3, 0.5, 0.83])
def test_halftones_are_bilevel_and_keep_the_tone(tone):
    dots = halftoned(np.full((200, 300), tone, np.float32))
    assert set(np.unique(dots)) == {0.0, 1.0}
    assert dots.mean() == pytest.approx(tone, abs=0.002)


def test_halftones_follow_a_gradient_locally():
    ramp = np.tile(np.linspace(0, 1, 512, dtype=np.float32), (256, 1))
    dots = halftoned(ramp).reshape(8, 32, 16, 32).mean(axis=(1, 3))
    assert np.abs(dots - ramp.reshape(8, 32, 16, 32).mean(axis=(1, 3))).max() < 0.03


def test_a_perfect_sheet_is_the_design():
    layers = assembled_layers(PROBE, Assembly(), halftone_dpi=None)
    part = window(layers, layers.film, PATTERN)
    x, _ = PATTERN.center_mm
    column = round((x - layers.first_mm[0]) * layers.per_mm)
    half = part.shape[1] // 2
    x_mm = layers.first_mm[0] + np.arange(column - half, column + half) / layers.per_mm
    phase = (2 * np.pi * x_mm / PROBE.slab.period_mm).astype(np.float32)
    expected = PROBE.film_transmittance * film_transmittance(phase, "matched")
    np.testing.assert_allclose(part, np.broadcast_to(expected, part.shape), atol=2e-3)


def test_a_shift_turns_the_phase_and_leaves_the_amplitude():
    shift = 0.21
    plain = assembled_layers(PROBE, Assembly(), halftone_dpi=None)
    moved = assembled_layers(PROBE, Assembly(film=Print(Registration((shift, 0.13)))), halftone_dpi=None)
    (before, amplitude), (after, moved_amplitude) = (phase_of(s, s.film, PATTERN) for s in (plain, moved))
    turn = np.angle(np.exp(1j * (after - before)))
    assert turn == pytest.approx(-2 * np.pi * shift / PROBE.slab.period_mm, abs=2e-3)
    assert moved_amplitude == pytest.approx(amplitude, rel=5e-3)


def test_halftoning_and_blur_keep_the_pattern_but_for_the_blurs_loss():
    blur = 0.1
    printed = assembled_layers(PROBE, Assembly(film=Print(blur_mm=blur)))
    plain = assembled_layers(PROBE, Assembly(), halftone_dpi=None)
    (phase, amplitude), (true_phase, true_amplitude) = (phase_of(s, s.film, PATTERN) for s in (printed, plain))
    loss = np.exp(-2 * (np.pi * blur / PROBE.slab.period_mm) ** 2)
    assert amplitude / true_amplitude == pytest.approx(loss, rel=0.01)
    assert np.angle(np.exp(1j * (phase - true_phase))) == pytest.approx(0.0, abs=0.01)


def test_dot_gain_and_grey_ink_darken_and_lift_the_mean():
    gain, solid = 0.1, 0.04
    paper = Print(dot_gain=gain, solid=solid)
    layers = assembled_layers(PROBE, Assembly(paper=paper))
    phase = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    expected = PROBE.paper_reflectance * paper.tone(0.5 + 0.5 * np.cos(phase)).mean()
    assert window(layers, layers.paper, PATTERN).mean() == pytest.approx(expected, rel=5e-3)


def test_nothing_passes_under_the_frame():
    layers = assembled_layers(PROBE, Assembly(), halftone_dpi=None)
    border = round(2.0 * layers.per_mm)
    assert layers.film[:border].max() == layers.film[:, -border:].max() == 0.0


def test_thicker_glass_is_the_slabs_and_leaves_the_print():
    layers = assembled_layers(PROBE, Assembly(glass_scale=1.02), halftone_dpi=None)
    assert layers.slab.glass_mm == pytest.approx(1.02 * PROBE.glass_mm)
    plain = assembled_layers(PROBE, Assembly(), halftone_dpi=None)
    turn = phase_of(layers, layers.film, PATTERN)[0] - phase_of(plain, plain.film, PATTERN)[0]
    assert np.angle(np.exp(1j * turn)) == pytest.approx(0.0, abs=1e-3)
