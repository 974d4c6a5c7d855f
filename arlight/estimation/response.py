"""A(view): what each block's mean and stripe harmonics are for unit coefficients, from one point of view.

A pixel whose film point has the phase phi sees paper of phase phi - b, b = 2 pi n.Delta(v). With film harmonics f_a and
radiosity harmonics B_l its radiance is T(v)/pi * sum f_a B_l exp(i (a + l) phi) exp(-i l b): harmonic m collects all
a + l = m (paper, eqs 12-19, with real layers). Rows are real: mean, cosine 1, sine 1, ... of the film's phase.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.layer_series import HARMONICS as STACK_HARMONICS
from arlight.estimation.resampling import measured_frequencies
from arlight.estimation.slab_echo import uniform_light
from arlight.estimation.stack import paper_light
from arlight.probe.assembly import Assembly
from arlight.probe.design import Block, Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import HARMONICS, ROWS, BlockMeans

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class BlockResponse:
    """The response of a sheet's blocks; everything that does not depend on the view is computed once."""

    places: NDArray[np.int64]
    """(blocks, c) which real-packed coefficients the columns of a block's rows belong to."""

    def __init__(
        self, probe: Probe, assembly: Assembly | None = None, *, bounces: bool = True, echoes: bool = True
    ) -> None:
        """Solve the stack of every block.

        Args:
            probe: the sheet.
            assembly: how it was printed and put together; exactly as designed by default.
            bounces: follow the light reflected between paper and glass.
            echoes: follow the light that goes back and forth inside the glass.
        """
        blocks = field_blocks(probe)
        light = paper_light(probe, blocks, assembly, bounces=bounces, echoes=echoes)
        self._slab = (assembly or Assembly()).slab(probe)
        self._film = _toeplitz(light.film)
        self._echo = light.echo
        if light.echo is not None:
            self._usual_light = uniform_light(self._slab, measured_frequencies(probe, assembly or Assembly()))
        # share of the light that the film's second crossing leaves on its way out
        self._passed_twice = np.einsum("bl,bl->b", light.film, np.conj(light.film)).real
        # (blocks, m, l, c): film harmonic m - l times radiosity harmonic l
        self._paths = self._film[..., None] * light.radiosity[:, None]
        self.places, known = _places(probe, blocks, self._paths.shape[3])
        self._paths *= known[:, None, None, :]
        # the lower face mirrors through the film twice, 2 D(v) apart: film harmonics m - l and l, turned by 2 l b
        self._mirror = self._film * light.film[:, None]

    def light(self, means: BlockMeans, shape: Array | None = None) -> Array:
        """Rows (blocks, 7, c) for unit coefficients before blur.

        Columns are L_0, Re L_n and Im L_n of each block's own frequency n, then Re L_2n and Im L_2n where the film has
        a second harmonic; `places` has where they belong.

        Args:
            means: says from where the blocks are seen.
            shape: (2k - 1,) real-packed coefficients relative to L_0, as far as known, for what the light near the
                horizon does inside the glass; a uniform sky's by default.
        """
        turn = view_powers(means.view_phasor, 1)
        series = np.einsum("bmlk,bl->bmk", self._paths, turn)
        if self._echo is not None:
            echo = self._echo @ (self._usual_light if shape is None else shape)
            series[:, :, 0] += np.einsum("bml,bl->bm", self._film, echo * turn)
        return _real_rows(series) * (self._leaving(means.view_cosine) / np.pi)[:, None, None]

    def _leaving(self, view_cosine: Array) -> Array:
        """(blocks,) share of the paper's light that leaves toward the viewer, beside the film's first crossing.

        What the upper face sends back crosses the film twice more before it leaves 2 D(v) further on; that small part
        counts with the film's mean square.
        """
        transmittance = self._slab.transmittance(view_cosine)
        if self._echo is None:
            return np.asarray(transmittance, float)
        twice = self._slab.interface_reflectance(view_cosine) ** 2
        return np.asarray(transmittance * (1.0 - twice) / (1.0 - twice * self._passed_twice), float)

    def lower_mirror(self, means: BlockMeans) -> Array:
        """Rows (blocks, 7) of the mirror reflection in the glass's lower face, where the upper face's is 1."""
        turn = view_powers(means.view_phasor, 2)
        series = np.einsum("bml,bl->bm", self._mirror, turn)
        passed = (1.0 - self._slab.interface_reflectance(means.view_cosine)) ** 2
        return _real_rows(series[..., None])[..., 0] * passed[:, None]


def _places(probe: Probe, blocks: tuple[Block, ...], columns: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Real-packed places (blocks, c) of the columns, and which of them the sheet's order has."""
    place = {(int(u), int(v)): k for k, (u, v) in enumerate(probe.frequencies)}
    places = np.zeros((len(blocks), columns), np.int64)
    known = np.zeros((len(blocks), columns), bool)
    known[:, 0] = True
    for i, block in enumerate(blocks):
        u, v = block.frequency or (0, 0)
        for j in range(1, (columns + 1) // 2):
            k = place.get((j * u, j * v), 0)
            if k:
                places[i, 2 * j - 1 : 2 * j + 1] = 2 * k - 1, 2 * k
                known[i, 2 * j - 1 : 2 * j + 1] = True
    return places, known


def view_powers(phasor: ComplexArray, step: int) -> ComplexArray:
    """Means of exp(-i step l b) for l = -H..H, from the mean phasor of b over a block.

    The spread of b over a block is small and nearly uniform, so its characteristic function falls as that of any narrow
    distribution: |mean exp(-i k b)| = |mean exp(-i b)|^(k^2).
    """
    power = step * np.arange(-STACK_HARMONICS, STACK_HARMONICS + 1)
    length = np.maximum(np.abs(phasor), 1e-6)
    return length[:, None] ** (power**2) * np.exp(1j * np.outer(np.angle(phasor), power))


def optical_transfer(cycles_per_px: Array, blur_variance_px2: float) -> Array:
    """What pixel and blur leave of each row (blocks, 7): 1 for the mean, the transfer at m n for harmonic m.

    Args:
        cycles_per_px: (blocks, 2) frequency of the stripes in the image [1/px].
        blur_variance_px2: variance of a Gaussian blur beside the pixel's square [px^2].
    """
    harmonic = np.concatenate([[0], np.repeat(np.arange(1, HARMONICS + 1), 2)])
    frequency = harmonic[:, None] * cycles_per_px[:, None, :]
    square = np.prod(np.sinc(frequency), axis=-1)
    return square * np.exp(-2.0 * np.pi**2 * blur_variance_px2 * np.sum(frequency**2, axis=-1))


def _toeplitz(film: ComplexArray) -> ComplexArray:
    """(blocks, m, l): film harmonic m - l for m = 0..3, l = -H..H."""
    size = film.shape[1]
    index = np.subtract.outer(np.arange(HARMONICS + 1), np.arange(size)) + 2 * STACK_HARMONICS
    return np.where((index >= 0) & (index < size), film[:, np.clip(index, 0, size - 1)], 0.0)


def _real_rows(series: ComplexArray) -> Array:
    """Mean, cosine and sine rows (blocks, 7, k) of harmonics (blocks, 4, k) of a real function."""
    rows = np.empty((series.shape[0], ROWS, series.shape[2]))
    rows[:, 0] = series[:, 0].real
    rows[:, 1::2] = 2.0 * series[:, 1:].real
    rows[:, 2::2] = -2.0 * series[:, 1:].imag
    return rows
