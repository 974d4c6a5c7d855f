"""What film, glass and paper make of the light: the paper's brightness as a linear function of the coefficients.

Along a block's frequency n everything repeats, so every quantity is a short Fourier series in the phase
psi = 2 pi n.p/P of the paper point p. Light enters through the film (paper, eqs 3-4), is scattered by the paper, and a
part of it comes back: from the lower face of the glass at once, from the upper face after two more passes through the
film, 2 D(w) to the side. Both returns are linear, hence one small linear system a block, solved once. It does not
depend on the view.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import j0

from arlight.optics import Slab
from arlight.probe.design import Block, Design, Probe

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

HARMONICS = 4
"""Highest harmonic of psi that is followed; what is beyond it changes the ones below by less than 1e-4."""

_QUADRATURE_NODES = 96


@dataclass(frozen=True, slots=True)
class PaperLight:
    """Radiosity of the paper under unit coefficients, for every block."""

    radiosity: ComplexArray
    """(blocks, 2 H + 1, 3): harmonics -H..H of the paper's radiosity for unit L_0, Re L_n and Im L_n."""
    film: ComplexArray
    """(blocks, 2 H + 1): harmonics -H..H of the film's transmittance."""


def paper_light(probe: Probe, blocks: tuple[Block, ...], *, bounces: bool = True) -> PaperLight:
    """Solve for the paper's radiosity in the middle of each block.

    Args:
        probe: gives the slab and the two layers' reflectance and transmittance.
        blocks: the blocks of the field, patterned or not.
        bounces: follow the light reflected between paper and glass; without it, single scattering as in the paper.

    Returns:
        Harmonics in the phase of the film's pattern at the paper point; for blocks without pattern only harmonic 0
        is not zero, and Re L_n and Im L_n have no effect.
    """
    size = 2 * HARMONICS + 1
    radiosity = np.zeros((len(blocks), size, 3), complex)
    film = np.zeros((len(blocks), size), complex)
    for i, block in enumerate(blocks):
        film[i] = probe.film_transmittance * film_harmonics(block, probe.design)
        paper = probe.paper_reflectance * paper_harmonics(block, probe.design)
        radiosity[i] = _radiosity(film[i], paper, block, probe.slab, bounces)
    return PaperLight(radiosity, film)


def film_harmonics(block: Block, design: Design) -> ComplexArray:
    """Fourier series -H..H of the film's transmittance relative to clear film, in its own phase."""
    match block.kind, design:
        case "pattern", "matched":
            return _series({0: 0.5, 1: 0.25})
        case "pattern", "doubled":
            return _series({0: 0.5, 1: 0.25j})
        case (("clear_white" | "clear_black"), _):
            return _series({0: 1.0})
        case _:
            return _series({})


def paper_harmonics(block: Block, design: Design) -> ComplexArray:
    """Fourier series -H..H of the paper's reflectance relative to white paper, in the film's phase above it."""
    phase = np.exp(1j * np.deg2rad(block.phase_deg or 0.0))
    match block.kind, design:
        case "pattern", "matched":
            return _series({0: 0.5, 1: 0.25 * phase})
        case "pattern", "doubled":
            return _series({0: 0.5, 2: -0.25j * phase})
        case (("clear_white" | "black_white"), _):
            return _series({0: 1.0})
        case _:
            return _series({})


def _radiosity(film: ComplexArray, paper: ComplexArray, block: Block, slab: Slab, bounces: bool) -> ComplexArray:
    """Solve (1 - g K) B = g E for the three unit lightings; columns L_0, Re L_n, Im L_n."""
    # E(psi) = sum_j f_j conj(L_jn) exp(i j psi), and conj(L_n) = Re - i Im
    centre = HARMONICS
    entering = np.zeros((len(film), 3), complex)
    entering[centre, 0] = film[centre]
    entering[centre + 1, 1:] = film[centre + 1] * np.array([1.0, -1j])
    entering[centre - 1, 1:] = film[centre - 1] * np.array([1.0, 1j])
    reflect = _convolution(paper)
    if not bounces:
        return np.asarray(reflect @ entering, complex)
    returned = _returned_light(film, float(np.hypot(*(block.frequency or (0, 0)))), slab)
    return np.asarray(np.linalg.solve(np.eye(len(film)) - reflect @ returned, reflect @ entering), complex)


def _returned_light(film: ComplexArray, frequency: float, slab: Slab) -> ComplexArray:
    """Irradiance on the paper, harmonic by harmonic, from the paper's own radiosity.

    A ray that returns to p left the paper at p - 2 D and crossed the film, twice, at p - D. With radiosity harmonic k
    and harmonic a of the squared film the phases add up to (k + a) psi - (2 k + a) 2 pi n.Delta, averaged over all D.
    """
    harmonics = np.arange(-HARMONICS, HARMONICS + 1)
    squared = np.convolve(film, film)[HARMONICS : 3 * HARMONICS + 1]
    k, total = np.meshgrid(harmonics, harmonics, indexing="xy")
    a = total - k
    within = np.abs(a) <= HARMONICS
    film_part = np.where(within, squared[np.clip(a + HARMONICS, 0, 2 * HARMONICS)], 0.0)
    upper = film_part * upper_face_return(slab, frequency * np.abs(2 * k + a))
    return np.asarray(upper + lower_face_return(slab) * np.eye(len(harmonics)), complex)


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
    kernel = j0(2.0 * np.pi * np.multiply.outer(np.asarray(frequency, float), radius))
    return kernel @ (weight * face * (1.0 - face) ** 2)


def _hemisphere() -> tuple[Array, Array]:
    """Gauss nodes mu and weights of 2 mu d mu over the cosine-weighted hemisphere."""
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_NODES)
    mu = 0.5 * (nodes + 1.0)
    return mu, weights * mu


def _series(positive: dict[int, complex]) -> ComplexArray:
    """Harmonics -H..H of a real function from its harmonics >= 0."""
    series = np.zeros(2 * HARMONICS + 1, complex)
    for harmonic, value in positive.items():
        series[HARMONICS + harmonic] = value
        series[HARMONICS - harmonic] = np.conj(value)
    return series


def _convolution(series: ComplexArray) -> ComplexArray:
    """Matrix that multiplies a series -H..H by the given one, cut at H."""
    size = len(series)
    index = np.subtract.outer(np.arange(size), np.arange(size)) + HARMONICS
    return np.where((index >= 0) & (index < size), series[np.clip(index, 0, size - 1)], 0.0)
