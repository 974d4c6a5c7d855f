"""Bilevel layers for a printer of given resolution, right in all that the sheet measures.

Error diffusion puts its error above the stripes' frequencies, but it also sharpens: plain Floyd-Steinberg prints
stripes of 20 dots with 5 % too much modulation, of 10 dots with 10 %. Each block is therefore diffused again, a few
times, from a target corrected by the harmonics 0 to 3 of its own error. What is left in them is the dots' randomness.

Source: Floyd and Steinberg, An adaptive algorithm for spatial greyscale, 1976; serpentine scan and threshold noise
after Ulichney, Dithering with blue noise, 1988.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.errors import ProbeError
from arlight.optics import Slab
from arlight.probe import patterns
from arlight.probe.design import Block, Design, Probe
from arlight.probe.halftone_kernels import diffuse
from arlight.probe.patterns import Raster
from arlight.probe.tone import ToneCurve

Bilevel = NDArray[np.bool_]

HARMONICS = 3
"""Harmonics of a block's stripes in which its print is corrected."""
MM_PER_INCH = 25.4
_CORRECTIONS = 4
_LEAD_DOTS = 16
"""Dots around a block that are computed and dropped: diffusion needs a few to settle."""
_FEWEST_DOTS = 5.0
"""Dots of the finest stripe's period below which a bilevel printer cannot draw it."""


@dataclass(frozen=True, slots=True)
class Tones:
    """How the printer prints each medium; None is a printer that prints what it is asked for."""

    film: ToneCurve | None = None
    """Of the transparency."""
    paper: ToneCurve | None = None
    """Of the paper, which the frame is printed on too."""


@dataclass(frozen=True, slots=True)
class Halftones:
    """The three printed layers of a bilevel printer, (rows, columns) of dots, True where nothing is printed."""

    film: Bilevel
    """The transparency."""
    paper: Bilevel
    """The paper."""
    frame: Bilevel
    """The frame."""
    dpi: float
    """Dots per inch."""


def require_dots(slab: Slab, order: int, design: Design, dpi: float) -> None:
    """Refuse a printer that cannot draw a sheet's finest stripes.

    Raises:
        ProbeError: fewer than five dots a period; the message says which resolution or order would do.
    """
    finest_mm = slab.period_mm / (order * (2 if design == "doubled" else 1))
    dots = finest_mm * dpi / MM_PER_INCH
    if dots < _FEWEST_DOTS:
        largest = int(order * dots / _FEWEST_DOTS)
        remedy = f"an order of at most {largest}" if largest else "thicker glass"
        enough = _FEWEST_DOTS / finest_mm * MM_PER_INCH
        raise ProbeError(
            f"{dpi:g} dpi is too coarse for order {order}: the finest stripes have a period of {finest_mm:.2f} mm, "
            f"{dots:.1f} dots, and {_FEWEST_DOTS:g} are needed; print with {enough:.0f} dpi or more, or choose {remedy}"
        )


def render_halftones(probe: Probe, tones: Tones | None = None) -> Halftones:
    """The layers of a sheet as dots, one a raster pixel of the probe.

    Args:
        probe: the sheet; its `pixels_per_mm` is the printer's resolution.
        tones: what the dots print as, to be compensated.

    Raises:
        ProbeError: the printer is too coarse for the stripes.
    """
    dpi = probe.pixels_per_mm * MM_PER_INCH
    require_dots(probe.slab, probe.order, probe.design, dpi)
    tones = tones or Tones()
    return Halftones(
        _striped(probe, patterns.film(probe) > 0.5, "film", tones.film),
        _striped(probe, patterns.paper(probe) > 0.5, "paper", tones.paper),
        _frame(probe, tones.paper),
        dpi,
    )


def halftone(target: Raster, phase: Raster | None = None, seed: int = 0, lead: int = 0) -> Bilevel:
    """Dots whose mean, and harmonics of the stripes, are the target's.

    Args:
        target: (rows, columns) share of dots left unprinted, [0, 1].
        phase: (rows, columns) phase of the target's stripes [rad]; None for an even tone, of which the mean alone is
            corrected.
        seed: of the threshold noise; the same seed gives the same dots.
        lead: rows and columns along each border to drop from the result.

    Returns:
        (rows - 2 lead, columns - 2 lead) True where nothing is printed.
    """
    inner = (slice(lead, target.shape[0] - lead), slice(lead, target.shape[1] - lead))
    basis = _harmonic_basis(phase, target.shape)
    seen = basis[(slice(None), *inner)].reshape(len(basis), -1)
    unmixed = np.linalg.inv((seen @ seen.T).astype(float)).astype(np.float32)
    wanted, asked = target[inner], target.astype(np.float32)
    best = dots = diffuse(asked, seed)
    least = np.inf
    for _ in range(_CORRECTIONS):
        error = unmixed @ (seen @ (dots[inner] - wanted).ravel())
        if np.linalg.norm(error) < least:
            best, least = dots, float(np.linalg.norm(error))
        asked = asked - np.tensordot(error, basis, axes=1)
        dots = diffuse(asked, seed)
    if np.linalg.norm(unmixed @ (seen @ (dots[inner] - wanted).ravel())) < least:
        best = dots
    return np.ascontiguousarray(best[inner]) > 0


def _harmonic_basis(phase: Raster | None, shape: tuple[int, ...]) -> Raster:
    """1, cos, sin, cos 2, ... of the stripes' phase, (waves, rows, columns)."""
    waves = [np.ones(shape, np.float32)]
    if phase is not None:
        cosine, sine = np.cos(phase), np.sin(phase)
        c, s = cosine, sine
        for _ in range(HARMONICS):
            waves += [c, s]
            c, s = c * cosine - s * sine, c * sine + s * cosine
    return np.stack(waves)


def _striped(probe: Probe, layer: Bilevel, name: str, tone: ToneCurve | None) -> Bilevel:
    """Draw the blocks' stripes into a layer whose other parts are black or white."""
    for block in probe.blocks:
        if block.frequency is None or block.phase_deg is None:
            continue
        rows, columns = patterns.block_pixels(probe, block)
        phase = patterns.stripe_phase(probe, block, _widened(rows), _widened(columns))
        if name == "film":
            value = patterns.film_transmittance(phase, probe.design)
        else:
            value = patterns.paper_reflectance(phase, np.radians(block.phase_deg), probe.design)
        if tone is not None:
            value = tone.compensated(value).astype(np.float32)
        layer[rows, columns] = halftone(value, phase, _seed(block, name), _LEAD_DOTS)
    return layer


def _frame(probe: Probe, tone: ToneCurve | None) -> Bilevel:
    """Markers are black and white; the wedge's steps are dots that print as their reflectance."""
    reflectance, _ = patterns.frame(probe)
    layer = np.asarray(reflectance > 0.5, bool)
    for block in probe.blocks:
        if block.reflectance is not None:
            rows, columns = patterns.block_pixels(probe, block)
            share = block.reflectance if tone is None else float(tone.share_for(block.reflectance))
            layer[rows, columns] = even_tone(share, (rows.stop - rows.start, columns.stop - columns.start), block.id)
    return layer


def even_tone(share: float, shape: tuple[int, int], seed: int) -> Bilevel:
    """Dots (rows, columns) of which a share in [0, 1] is left unprinted."""
    around = (shape[0] + 2 * _LEAD_DOTS, shape[1] + 2 * _LEAD_DOTS)
    return halftone(np.full(around, share, np.float32), None, seed, _LEAD_DOTS)


def _widened(span: slice) -> slice:
    return slice(span.start - _LEAD_DOTS, span.stop + _LEAD_DOTS)


def _seed(block: Block, name: str) -> int:
    # film and paper of a block differ in their noise, or their dots would beat
    return 2 * block.id + (name == "paper")
