"""Fourier series of printed layers: what a block's film transmits and its paper reflects, in the stripes' own phase."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from arlight.probe.assembly import Print
from arlight.probe.design import Block, BlockKind, Design

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Profile = Callable[[Array], Array]

HARMONICS = 4
"""Highest harmonic that is followed; what is beyond it changes the ones below by less than 1e-4."""

_SAMPLES = 32
"""Samples of a period: toned patterns are trigonometric polynomials of degree 4 at most, resolved exactly."""


def film_series(blocks: tuple[Block, ...], design: Design, made: Print, cycles_per_mm: Array) -> ComplexArray:
    """Harmonics -H..H (blocks, 2 H + 1) of the film's transmittance relative to clear film, in its own phase.

    Args:
        made: how the film was printed.
        cycles_per_mm: (blocks, 2) frequency of each block's stripes [1/mm].
    """
    profiles = [_film_profile(block.kind, design) for block in blocks]
    return _series(profiles, made, cycles_per_mm)


def paper_series(blocks: tuple[Block, ...], design: Design, made: Print, cycles_per_mm: Array) -> ComplexArray:
    """Harmonics -H..H (blocks, 2 H + 1) of the paper's reflectance relative to white paper, in the film's phase above.

    Args: as for `film_series`; the phase is the film's as designed.
    """
    profiles = [_paper_profile(block.kind, design, np.deg2rad(block.phase_deg or 0.0)) for block in blocks]
    return _series(profiles, made, cycles_per_mm)


def turned(series: ComplexArray, lead_rad: Array) -> ComplexArray:
    """Series (blocks, 2 H + 1) of patterns that lie ahead by a phase (blocks,) [rad]."""
    harmonics = np.arange(-HARMONICS, HARMONICS + 1)
    return np.asarray(series * np.exp(1j * np.multiply.outer(lead_rad, harmonics)), complex)


def real_parts(series: ComplexArray) -> Array:
    """Mean, then real and imaginary parts of harmonics 1..H (..., 2 H + 1), of real functions' series -H..H."""
    parts = np.empty(series.shape)
    parts[..., 0] = series[..., HARMONICS].real
    parts[..., 1::2], parts[..., 2::2] = series[..., HARMONICS + 1 :].real, series[..., HARMONICS + 1 :].imag
    return parts


def convolution(series: ComplexArray) -> ComplexArray:
    """(blocks, m, l) matrices that multiply series -H..H by the given ones (blocks, 2 H + 1), cut at H."""
    size = series.shape[1]
    index = np.subtract.outer(np.arange(size), np.arange(size)) + HARMONICS
    return np.where((index >= 0) & (index < size), series[:, np.clip(index, 0, size - 1)], 0.0)


def _film_profile(kind: BlockKind, design: Design) -> Profile:
    match kind, design:
        case "pattern", "matched":
            return lambda phase: 0.5 + 0.5 * np.cos(phase)
        case "pattern", "doubled":
            return lambda phase: 0.5 - 0.5 * np.sin(phase)
        case (("clear_white" | "clear_black"), _):
            return np.ones_like
        case _:
            return np.zeros_like


def _paper_profile(kind: BlockKind, design: Design, tau: float) -> Profile:
    match kind, design:
        case "pattern", "matched":
            return lambda phase: 0.5 + 0.5 * np.cos(phase + tau)
        case "pattern", "doubled":
            return lambda phase: 0.5 + 0.5 * np.sin(2.0 * phase + tau)
        case (("clear_white" | "black_white"), _):
            return np.ones_like
        case _:
            return np.zeros_like


def _series(profiles: list[Profile], made: Print, cycles_per_mm: Array) -> ComplexArray:
    phase = 2.0 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    values = np.array([made.tone(profile(phase)) for profile in profiles]).reshape(-1, _SAMPLES)
    spectrum = np.fft.fft(values, axis=1) / _SAMPLES
    harmonics = np.arange(-HARMONICS, HARMONICS + 1)
    blur = 2.0 * (np.pi * made.blur_mm) ** 2 * np.multiply.outer(np.sum(cycles_per_mm**2, axis=1), harmonics**2)
    return np.asarray(spectrum[:, harmonics] * np.exp(-blur), complex)
