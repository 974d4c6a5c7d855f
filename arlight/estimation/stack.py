"""What film, glass and paper make of the light: the paper's brightness as a linear function of the coefficients.

Along a block's frequency n everything repeats, so every quantity is a short Fourier series in the phase psi of the
film's pattern above the paper point. Light enters through the film (paper, eqs 3-4), is scattered by the paper, and a
part of it comes back: from the lower face of the glass at once, from the upper face after two more passes through the
film, 2 D(w) to the side. Both returns are linear, hence one small linear system a block, solved once. It does not
depend on the view.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.estimation.bessel import bessel_j0
from arlight.estimation.layer_series import (
    HARMONICS,
    convolution,
    film_series,
    paper_series,
    turned,
)
from arlight.estimation.resampling import measured_frequencies
from arlight.estimation.slab_echo import Echo, echo_irradiance
from arlight.optics import Slab
from arlight.probe.assembly import Assembly, BlockCorrections
from arlight.probe.design import Block, Probe
from arlight.tracking.block_layout import design_cycles_per_mm

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_QUADRATURE_NODES = 96
_NO_OVERTONE = 1e-6
"""Second harmonic of the film below which its response to L_2n is left out."""


@dataclass(frozen=True, slots=True)
class PaperLight:
    """Radiosity of the paper under unit coefficients, for every block.

    Columns are L_0, Re L_n and Im L_n; a film whose print has a second harmonic also sees Re L_2n and Im L_2n.
    """

    radiosity: ComplexArray
    """(blocks, 2 H + 1, 3 or 5): harmonics -H..H of the paper's radiosity for unit coefficients."""
    film: ComplexArray
    """(blocks, 2 H + 1): harmonics -H..H of the film's transmittance."""
    gathered: ComplexArray
    """(blocks, 2 H + 1, 2 H + 1): radiosity for unit harmonics of the irradiance that enters."""
    echo: Echo | None
    """Irradiance from light that went back and forth in the glass, beyond what T counts; None without bounces."""


def paper_light(
    probe: Probe,
    blocks: tuple[Block, ...],
    assembly: Assembly | None = None,
    *,
    bounces: bool = True,
    echoes: bool = True,
) -> PaperLight:
    """Solve for the paper's radiosity in the middle of each block.

    Args:
        probe: gives the design, the glass and the two unprinted layers' reflectance and transmittance.
        blocks: the blocks of the field, patterned or not.
        assembly: how the sheet was printed and put together; exactly as designed by default.
        bounces: follow the light reflected between paper and glass; without it, single scattering as in the paper.
        echoes: also work out `echo`.

    Returns:
        Harmonics in the phase of the film's pattern at the paper point; for blocks without pattern only harmonic 0
        is not zero, and only L_0 has an effect.
    """
    assembly = assembly or Assembly()
    cycles = design_cycles_per_mm(blocks, probe.slab.period_mm)
    film_cycles = assembly.film.registration.cycles_per_mm(cycles)
    paper_cycles = assembly.paper.registration.cycles_per_mm(cycles)
    film = probe.film_transmittance * film_series(blocks, probe.design, assembly.film, film_cycles)
    paper = probe.paper_reflectance * paper_series(blocks, probe.design, assembly.paper, paper_cycles)
    paper *= _beat(paper_cycles - film_cycles, blocks)
    paper = turned(paper, _paper_lead(assembly, blocks, film_cycles, paper_cycles))
    if assembly.blocks is not None:
        paper = _corrected(paper, assembly.blocks, probe.paper_reflectance)
    slab = assembly.slab(probe)
    cycles = film_cycles * slab.period_mm
    reflect = convolution(paper)
    if not bounces:
        return PaperLight(np.asarray(reflect @ _entering(film), complex), film, reflect, None)
    gathered = _gathered(film, reflect, np.hypot(*cycles.T), slab)
    echo = echo_irradiance(film, cycles, slab, measured_frequencies(probe, assembly)) if echoes else None
    return PaperLight(gathered @ _entering(film), film, gathered, echo)


def _paper_lead(assembly: Assembly, blocks: tuple[Block, ...], film_cycles: Array, paper_cycles: Array) -> Array:
    """(blocks,) how far misregistration puts the paper's pattern ahead of the film's, in the block's middle [rad]."""
    centers = np.array([block.center_mm for block in blocks], float).reshape(-1, 2)
    paper = np.sum(paper_cycles * (centers - assembly.paper.registration.shift_mm), axis=1)
    film = np.sum(film_cycles * (centers - assembly.film.registration.shift_mm), axis=1)
    return 2.0 * np.pi * (paper - film)


def _beat(difference_per_mm: Array, blocks: tuple[Block, ...]) -> Array:
    """(blocks, 2 H + 1) what is left of each harmonic over a block whose layers' stripes drift apart."""
    window = np.array([block.window_mm for block in blocks])
    drift = difference_per_mm[:, None, :] * np.arange(-HARMONICS, HARMONICS + 1)[:, None] * window[:, None, None]
    return np.asarray(np.prod(np.sinc(drift), axis=-1), float)


def _corrected(paper: ComplexArray, blocks: BlockCorrections, reflectance: float) -> ComplexArray:
    stripes = turned(paper * blocks.modulation[:, None], np.deg2rad(blocks.phase_deg))
    stripes[:, HARMONICS] = paper[:, HARMONICS] + reflectance * blocks.offset
    return np.asarray(stripes * blocks.gain[:, None], complex)


def _gathered(film: ComplexArray, reflect: ComplexArray, frequency: Array, slab: Slab) -> ComplexArray:
    """(blocks, m, l) radiosity (1 - g K)^-1 g of the light that enters, harmonic by harmonic."""
    returned = _returned_light(film, frequency, slab)
    return np.asarray(np.linalg.solve(np.eye(film.shape[1]) - reflect @ returned, reflect), complex)


def _entering(film: ComplexArray) -> ComplexArray:
    """Irradiance through the film E(psi) = sum_j f_j conj(L_jn) exp(i j psi), and conj(L_n) = Re - i Im."""
    overtone = int(np.max(np.abs(film[:, HARMONICS + 2]), initial=0.0) > _NO_OVERTONE)
    entering = np.zeros((*film.shape, 3 + 2 * overtone), complex)
    entering[:, HARMONICS, 0] = film[:, HARMONICS]
    for j in range(1, 2 + overtone):
        for sign in (1, -1):
            place = HARMONICS + sign * j
            entering[:, place, 2 * j - 1 : 2 * j + 1] = film[:, place, None] * np.array([1.0, -1j * sign])
    return entering


def _returned_light(film: ComplexArray, frequency: Array, slab: Slab) -> ComplexArray:
    """Irradiance on the paper, harmonic by harmonic, from the paper's own radiosity.

    A ray that returns to p left the paper at p - 2 D and crossed the film, twice, at p - D. With radiosity harmonic k
    and harmonic a of the squared film the phases add up to (k + a) psi - (2 k + a) 2 pi n.Delta, averaged over all D.
    """
    harmonics = np.arange(-HARMONICS, HARMONICS + 1)
    squared = np.einsum("bml,bl->bm", convolution(film), film)
    k, total = np.meshgrid(harmonics, harmonics, indexing="xy")
    a = total - k
    within = np.abs(a) <= HARMONICS
    film_part = np.where(within, squared[:, np.clip(a + HARMONICS, 0, 2 * HARMONICS)], 0.0)
    # blocks share few lengths of n, and 2 k + a is a small integer
    lengths, place = np.unique(np.round(frequency, 9), return_inverse=True)
    multiples = np.abs(2 * k + a)
    upper = upper_face_return(slab, np.multiply.outer(lengths, np.arange(multiples.max() + 1)))
    return np.asarray(
        film_part * upper[place][:, multiples] + lower_face_return(slab) * np.eye(len(harmonics)), complex
    )


def lower_face_return(slab: Slab) -> float:
    """Share of diffuse light that the lower face of the glass sends back to where it came from."""
    mu, weight = _hemisphere()
    return float(np.sum(weight * slab.interface_reflectance(mu)))


def upper_face_return(slab: Slab, frequency: ArrayLike) -> Array:
    """Transform of where diffuse light lands that the upper face sends back, clear film.

    Args:
        frequency: (...) total frequency |n| times (2 k + a), in cycles per unit of the light plane.

    Returns:
        (...) the share that returns at frequency 0, its Hankel transform elsewhere.
    """
    mu, weight = _hemisphere()
    face = slab.interface_reflectance(mu)
    sine = np.sqrt(1.0 - mu**2)
    radius = np.linalg.norm(slab.light_plane(np.stack([sine, 0 * sine, mu], axis=-1)), axis=-1)
    kernel = bessel_j0(2.0 * np.pi * np.multiply.outer(np.asarray(frequency, float), radius))
    return kernel @ (weight * face * (1.0 - face) ** 2)


@cache
def _hemisphere() -> tuple[Array, Array]:
    """Gauss nodes mu and weights of 2 mu d mu over the cosine-weighted hemisphere."""
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_NODES)
    mu = 0.5 * (nodes + 1.0)
    return mu, weights * mu
