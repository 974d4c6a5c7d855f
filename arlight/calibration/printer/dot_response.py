"""What a halftone's dots change in the blocks' responses, from the dots themselves.

A pixel sees film at q and paper at p = q - D(v), lit by E(p). The light blurs the film's dots out of E, all but the
harmonics of the stripes; film and paper as the camera sees them keep theirs, and their products. No formula of the
response is used: sums over dots, less the same sums over the design.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.probe import patterns
from arlight.probe.design import Block, Probe
from arlight.probe.halftone import MM_PER_INCH, Halftones, Tones
from arlight.probe.tone import ToneCurve
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import HARMONICS, ROWS, BlockMeans

Array = NDArray[np.float64]
Image = NDArray[np.float32]

_FINEST_MM = 0.045
"""Dots wider than this are summed over in parts: they are squares, and seen through each other at any offset."""


def dot_response_error(
    probe: Probe, dots: Halftones, tones: Tones, means: BlockMeans, camera_mm: Array, blur_mm: float
) -> Array:
    """Rows (blocks, 7, 3) that a sheet's dots add to the response of its design, single scattering.

    Args:
        probe: the sheet, at the printer's resolution.
        dots: its halftones.
        tones: for which they are compensated.
        means: the blocks' view.
        camera_mm: (3,) where the camera stands in the probe frame [mm].
        blur_mm: standard deviation by which ink and medium blur the dots [mm].
    """
    blocks = field_blocks(probe)
    error = np.zeros((len(blocks), ROWS, 3))
    parts = int(np.ceil(MM_PER_INCH / dots.dpi / _FINEST_MM))
    fine = replace(probe, pixels_per_mm=probe.pixels_per_mm * parts)
    sigma = blur_mm * fine.pixels_per_mm
    inner = int(np.ceil(probe.slab.max_offset_mm * fine.pixels_per_mm))
    for i, block in enumerate(blocks):
        if block.frequency is None or block.phase_deg is None:
            continue
        place = patterns.block_pixels(probe, block)
        fine_place = [slice(parts * span.start, parts * span.stop) for span in place]
        phase = patterns.stripe_phase(fine, block, fine_place[0], fine_place[1])
        tau = np.radians(block.phase_deg)
        film = patterns.film_transmittance(phase, probe.design)
        paper = patterns.paper_reflectance(phase, tau, probe.design)
        printed_film = film + _strays(dots.film[place], film, tones.film, parts)
        printed_paper = paper + _strays(dots.paper[place], paper, tones.paper, parts)
        shift = _view_offset(fine, block, camera_mm)
        actual = _rows(_blurred(printed_film, sigma), _blurred(printed_paper, sigma), phase, shift, inner)
        error[i] = actual - _rows(_blurred(film, sigma), _blurred(paper, sigma), phase, shift, inner)
    scale = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
    return error * (scale * probe.slab.transmittance(means.view_cosine))[:, None, None]


def _strays(dots: NDArray[np.bool_], value: Image, tone: ToneCurve | None, parts: int) -> Image:
    """What the dots are beside the share that was asked for, each in parts x parts samples."""
    share = value if tone is None else tone.compensated(value).astype(np.float32)
    return np.asarray(dots.repeat(parts, axis=0).repeat(parts, axis=1) - share, np.float32)


def _view_offset(probe: Probe, block: Block, camera_mm: Array) -> tuple[int, int]:
    """Rows and columns from a film point to the paper point that is seen through it, in whole raster pixels."""
    toward = camera_mm - np.array([*block.center_mm, 0.0])
    offset = probe.slab.offset_mm(toward / np.linalg.norm(toward)) * probe.pixels_per_mm
    return round(float(offset[1])), -round(float(offset[0]))


def _blurred(image: Image, sigma: float) -> Image:
    if sigma <= 0.0:
        return image
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REFLECT), np.float32)


def _rows(film: Image, paper: Image, phase: Image, shift: tuple[int, int], inner: int) -> Array:
    """Mean and harmonics (7, 3) of f(q) g(p) E(p) in the film's phase at q, for unit L_0, Re L_n and Im L_n."""
    mean, cosine, sine = _harmonics(film, phase)[:3]
    rows, columns = film.shape
    below, right = shift
    at_paper = slice(inner, rows - inner), slice(inner, columns - inner)
    at_film = slice(inner - below, rows - inner - below), slice(inner - right, columns - inner - right)
    psi = phase[at_paper]
    lit = np.stack(
        [
            np.full_like(psi, mean),
            cosine * np.cos(psi) + sine * np.sin(psi),
            cosine * np.sin(psi) - sine * np.cos(psi),
        ],
        axis=-1,
    )
    seen = (film[at_film] * paper[at_paper])[..., None] * lit
    return _harmonics(seen, phase[at_film])


def _harmonics(values: Image, phase: Image) -> Array:
    """Least-squares mean, cosine 1, sine 1, ... (7, ...) of values (rows, columns, ...) at phases (rows, columns)."""
    waves = [np.ones_like(phase)] + [wave(k * phase) for k in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)]
    basis = np.stack(waves).reshape(ROWS, -1)
    right = basis @ values.reshape(phase.size, -1)
    fit = np.linalg.solve((basis @ basis.T).astype(float), right.astype(float))
    return fit.reshape(ROWS, *values.shape[2:])
