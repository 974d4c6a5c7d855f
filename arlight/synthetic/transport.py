"""Light transport from a distant environment through the film to the paper, for the actual printed layers.

The irradiance of the paper does not depend on the viewer. What comes straight, the sum over lights of
l (1 - R)^2 d omega^N film(p + D(w)), is a correlation, computed exactly in band by FFT; what goes back and forth in the
glass is added light by light, and what returns from the paper bounce by bounce. No closed form of the patterns is used,
so estimates can be tested on it.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from arlight.environment import Environment
from arlight.optics import Slab
from arlight.synthetic.echoes import SlabEchoes
from arlight.synthetic.interreflection import Interreflection
from arlight.synthetic.sheet import SheetLayers

Array = NDArray[np.floating[Any]]
Image = NDArray[np.float32]

GRID_PER_MM = 10.0
SPLAT_PER_MM = 50.0
WORKERS = 2


@dataclass(frozen=True, slots=True)
class IrradianceMap:
    """Irradiance of the paper under the frame's window and a little around it."""

    irradiance: Image
    """(rows, columns, 3) [radiance * sr]; row 0 toward +y."""
    first_mm: tuple[float, float]
    """(x, y) of the centre of sample [0, 0] in the probe frame [mm]."""
    texel_mm: float
    """Distance of neighbouring samples [mm]."""


@dataclass(frozen=True)
class LightTransport:
    """Turns an environment into the irradiance of a sheet's paper. What does not depend on the light is kept."""

    layers: SheetLayers
    """The sheet."""
    slab: Slab
    """The glass between film and paper."""
    bounces: int = 3
    """How often light returned to the paper by the glass is followed; 0 for single scattering, in which T counts what
    goes back and forth in the glass as if it came straight."""

    def irradiance(self, environment: Environment) -> IrradianceMap:
        """Irradiance of the paper [radiance * sr] under an environment; linear in its radiance."""
        directions, light = environment.samples()
        cosine = directions[:, 2]
        straight = (1.0 - self.slab.interface_reflectance(cosine)) ** 2
        received = light * (cosine * (straight if self.bounces else self.slab.transmittance(cosine)))[:, None]
        kernel = _light_spectrum(
            self.slab.offset_mm(directions), received, self.slab.max_offset_mm, self._frequencies_per_mm
        )
        planes = np.stack([self._correlate(channel) for channel in kernel])
        if self.bounces:
            planes += self._echoes.irradiance(directions, light)
        np.maximum(planes, 0.0, out=planes)
        if self.bounces:
            planes = self._interreflection.total_irradiance(planes, self.bounces)
        irradiance = np.ascontiguousarray(planes.transpose(1, 2, 0))
        return IrradianceMap(irradiance, self._first_mm, self._step / self.layers.pixels_per_mm)

    @cached_property
    def _step(self) -> int:
        return max(1, int(self.layers.pixels_per_mm / GRID_PER_MM + 1e-6))

    @cached_property
    def _crop(self) -> tuple[slice, slice]:
        """The window and around it as far as light reaches and bounces under the frame, in whole grid steps."""
        margin = int(np.ceil(2.0 * self.slab.max_offset_mm * self.layers.pixels_per_mm))
        slices = []
        for axis in (0, 1):
            lit = np.flatnonzero(self.layers.opening.max(axis=1 - axis) > 0)
            first, last = (lit[0], lit[-1] + 1) if lit.size else (0, 1)
            start = max(0, first - margin)
            slices.append(slice(start, min(self.layers.film.shape[axis], last + margin)))
        return slices[0], slices[1]

    @cached_property
    def _first_mm(self) -> tuple[float, float]:
        rows, columns = self._crop
        width, height = self.layers.size_mm
        scale = self.layers.pixels_per_mm
        return (columns.start + 0.5) / scale - width / 2.0, height / 2.0 - (rows.start + 0.5) / scale

    @cached_property
    def _grid_shape(self) -> tuple[int, int]:
        """Samples kept of the coarse grid."""
        rows, columns = self._crop
        return -(-(rows.stop - rows.start) // self._step), -(-(columns.stop - columns.start) // self._step)

    @cached_property
    def _padded_shape(self) -> tuple[int, int]:
        """The coarse grid with room for the light's reach, so that the correlation does not wrap around."""
        reach = int(np.ceil(self.slab.max_offset_mm * self.layers.pixels_per_mm / self._step)) + 8
        rows, columns = (2 * scipy.fft.next_fast_len(-(-(n + reach) // 2)) for n in self._grid_shape)
        return rows, columns

    @cached_property
    def _frequencies_per_mm(self) -> tuple[Array, Array]:
        """Frequencies of the padded grid's spectrum toward +y and +x [1/mm]."""
        rows, columns = self._padded_shape
        spacing = self._step / self.layers.pixels_per_mm
        return -np.fft.fftfreq(rows, spacing), np.fft.rfftfreq(columns, spacing)

    def _spectrum(self, layer: Image) -> NDArray[np.complex64]:
        """Spectrum of a layer on the coarse grid, faded out toward the grid's limit so that edges do not ring."""
        rows, columns = self._padded_shape
        fine = scipy.fft.rfft2(layer[self._crop], s=(rows * self._step, columns * self._step), workers=WORKERS)
        coarse = np.concatenate([fine[: rows // 2], fine[-(rows // 2) :]])[:, : columns // 2 + 1]
        fade = np.outer(_fade(np.fft.fftfreq(rows)), _fade(np.fft.rfftfreq(columns)))
        return np.asarray(coarse * (fade / self._step**2), np.complex64)

    @cached_property
    def _film_spectrum(self) -> NDArray[np.complex64]:
        return self._spectrum(self.layers.film)

    def _correlate(self, kernel: NDArray[np.complex64]) -> Image:
        rows, columns = self._grid_shape
        full = scipy.fft.irfft2(self._film_spectrum * kernel, s=self._padded_shape, workers=WORKERS)
        return full[:rows, :columns]

    @cached_property
    def _film(self) -> Image:
        return self._coarse(self.layers.film)

    @cached_property
    def _film_squared(self) -> Image:
        return self._coarse(self.layers.film**2)

    def _coarse(self, layer: Image) -> Image:
        rows, columns = self._grid_shape
        full = scipy.fft.irfft2(self._spectrum(layer), s=self._padded_shape, workers=WORKERS)
        return np.maximum(full[:rows, :columns], 0.0)

    @cached_property
    def _interreflection(self) -> Interreflection:
        return Interreflection(
            film_squared=self._film_squared,
            paper=self._coarse(self.layers.paper),
            slab=self.slab,
            texel_mm=self._step / self.layers.pixels_per_mm,
        )

    @cached_property
    def _echoes(self) -> SlabEchoes:
        return SlabEchoes(self._film, self._film_squared, self.slab, self._step / self.layers.pixels_per_mm)


def _fade(cycles_per_sample: Array) -> NDArray[np.float32]:
    """1 up to a quarter cycle a sample, then a raised cosine down to 0 at half a cycle."""
    beyond = np.clip((np.abs(cycles_per_sample) - 0.25) / 0.25, 0.0, 1.0)
    return (0.5 + 0.5 * np.cos(np.pi * beyond)).astype(np.float32)


def _light_spectrum(
    offset_mm: Array,
    received: Array,
    reach_mm: float,
    frequencies_per_mm: tuple[Array, Array],
) -> NDArray[np.complex64]:
    """Sum over lights of received * exp(2 pi i f.D) on a grid of frequencies, (3, rows, columns).

    The lights are shared out bilinearly to a grid fine enough that a single lamp's amplitude is right to 0.2 % at the
    stripes of order 5 (on the irradiance's own grid it would be 5 %); the grid's spectrum is a product of two small
    Fourier matrices, and what sharing out takes from it, sinc^2, is divided out.
    """
    half = int(np.ceil(reach_mm * SPLAT_PER_MM)) + 1
    size = 2 * half + 1
    position = offset_mm * SPLAT_PER_MM + half
    cell = np.floor(position).astype(int)
    part = position - cell
    position_mm = (np.arange(size) - half) / SPLAT_PER_MM
    waves = [np.exp(2j * np.pi * f[:, None] * position_mm).astype(np.complex64) for f in frequencies_per_mm]
    loss = [np.sinc(f / SPLAT_PER_MM) ** 2 for f in frequencies_per_mm]
    inverse_loss = (1.0 / (loss[0][:, None] * loss[1])).astype(np.float32)
    spectra = []
    for channel in range(received.shape[1]):
        grid = np.zeros(size * size)
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            share = np.abs(1 - dx - part[:, 0]) * np.abs(1 - dy - part[:, 1])
            index = (cell[:, 1] + dy) * size + cell[:, 0] + dx
            grid += np.bincount(index, received[:, channel] * share, minlength=size * size)
        spectra.append((waves[0] @ grid.reshape(size, size).astype(np.float32)) @ waves[1].T * inverse_loss)
    return np.stack(spectra)
