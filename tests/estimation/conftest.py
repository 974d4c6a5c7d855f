"""Measurements of a sheet under given light, made from the response's own rows: what an estimator must undo."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from arlight.estimation.channel_fit import GREEN, SheetFit
from arlight.estimation.likely_light import LikelyLight
from arlight.estimation.measured_blocks import MeasuredBlocks
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.fourier import pack_real
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import ROWS, BlockMeans

PX_PER_MM = 5.0
SAMPLES = 400


@pytest.fixture(scope="session")
def probe() -> Probe:
    """A sheet of order 3."""
    return design_probe(order=3)


@pytest.fixture(scope="session")
def response(probe: Probe) -> BlockResponse:
    return BlockResponse(probe)


@pytest.fixture(scope="session")
def random_light(probe: Probe) -> Callable[..., np.ndarray]:
    """(k, 3) coefficients as natural light has them: |L_n| about a third of L_0, nearly the same in all colours."""

    def light(seed: int, color=(1.0, 1.0, 1.0), colorful: float = 0.02) -> np.ndarray:
        generator = np.random.default_rng(seed)
        count = len(probe.frequencies)
        order = np.maximum(np.hypot(*probe.frequencies.T), 1.0)[:, None]
        common = (generator.normal(size=(count, 1)) + 1j * generator.normal(size=(count, 1))) * 0.2 / np.sqrt(order)
        own = (generator.normal(size=(count, 3)) + 1j * generator.normal(size=(count, 3))) * colorful / np.sqrt(order)
        relative = common + own
        relative[0] = 1.0
        return 1.6 * relative * np.array(color)

    return light


def view_of(probe: Probe, camera_mm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Phasor and cosine of every block's view from a point, and its stripes' frequency in a picture from there."""
    blocks = field_blocks(probe)
    toward = np.asarray(camera_mm) - np.array([[*block.center_mm, 0.0] for block in blocks])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    n = np.array([block.frequency or (0, 0) for block in blocks], float)
    phasor = np.exp(-2j * np.pi * np.sum(n * probe.slab.light_plane(toward), axis=1))
    # seen along y at a slant, y shrinks
    scale = PX_PER_MM * np.array([1.0, 0.8])
    return phasor, toward[:, 2], n / probe.slab.period_mm / scale


@pytest.fixture(scope="session")
def blank(probe: Probe) -> Callable[..., BlockMeans]:
    """Measurements of black, from a camera at camera_mm, with pixels of a given noise."""

    def make(camera_mm=(20.0, -180.0, 260.0), sigma: float = 5e-4, samples: int = SAMPLES) -> BlockMeans:
        phasor, cosine, cycles = view_of(probe, camera_mm)
        count = len(phasor)
        harmonics = np.where(np.any(cycles != 0, axis=1), 3, 0)
        diagonal = np.tile([1.0, *(2.0,) * (ROWS - 1)], (count, 1)) / samples
        diagonal[:, 1:] *= (harmonics > 0)[:, None]
        return BlockMeans(
            values=np.zeros((count, ROWS, 3)),
            covariance=diagonal[:, :, None] * np.eye(ROWS),
            pixel_variance=np.full((count, 3), sigma**2),
            shading=np.zeros((count, 3)),
            harmonics=harmonics,
            samples=np.full(count, samples),
            valid=np.ones(count, bool),
            view_phasor=phasor,
            view_cosine=cosine,
            cycles_per_px=cycles,
            color_trust=np.ones(count),
        )

    return make


@pytest.fixture(scope="session")
def fresnel(probe: Probe) -> Callable[[BlockMeans], np.ndarray]:
    """(blocks, 1) how strongly each block mirrors toward the camera, relative to their mean."""

    def relative(means: BlockMeans) -> np.ndarray:
        face = probe.slab.interface_reflectance(means.view_cosine)
        return (face / face.mean())[:, None]

    return relative


@pytest.fixture(scope="session")
def lit(probe: Probe, response: BlockResponse) -> Callable[..., BlockMeans]:
    """Measurements with light added: coefficients (k, 3), mirrored radiance (blocks, 3) with the lower face's share."""
    blocks = field_blocks(probe)
    index = {tuple(n): k for k, n in enumerate(probe.frequencies.tolist())}
    column = np.array([index[block.frequency] if block.frequency else 0 for block in blocks])
    patterned = column > 0
    places = np.stack([np.zeros_like(column), np.where(patterned, 2 * column - 1, 0), 2 * column], axis=1)

    def add(
        means: BlockMeans,
        coefficients,
        mirrored=0.0,
        blur_variance_px2=0.4,
        lower_face=1.0,
        noise_seed=None,
        usual=False,
    ):
        transfer = optical_transfer(means.cycles_per_px, blur_variance_px2)
        packed = pack_real(coefficients)
        known = packed[places]
        known[~patterned, 1:] = 0.0
        shape = None if usual else packed[:, 1] / max(packed[0, 1], 1e-6)
        values = np.einsum("brk,bkc->brc", response.light(means, shape), known)
        mirror = lower_face * response.lower_mirror(means)
        mirror[:, 0] += 1.0
        mirrored = np.broadcast_to(mirrored, (len(blocks), 3))
        values = (values + mirror[..., None] * mirrored[:, None]) * transfer[..., None]
        if noise_seed is not None:
            deviation = np.sqrt(np.diagonal(means.covariance, axis1=1, axis2=2))[..., None]
            noise = np.random.default_rng(noise_seed).normal(size=values.shape)
            values = values + noise * deviation * np.sqrt(means.pixel_variance)[:, None]
        values[:, 1:] *= (means.harmonics > 0)[:, None, None]
        return replace(means, values=means.values + values)

    return add


@pytest.fixture(scope="session")
def lit_as_usual(lit: Callable[..., BlockMeans]) -> Callable[..., BlockMeans]:
    """The same for light whose horizon does in the glass what a uniform sky's does, as the bare response has it."""
    return partial(lit, usual=True)


@pytest.fixture(scope="session")
def plane(probe):
    """A reflection that is a plane over the sheet, rising from one side to the other."""
    centers = np.array([block.center_mm for block in field_blocks(probe)])
    return np.column_stack([np.ones(len(centers)), centers / 50.0])


class Fitted:
    """The compiled fit of a sheet, results in the sheet's own order."""

    def __init__(self, probe, response, basis):
        kinds = [block.kind for block in field_blocks(probe)]
        self.response, self.basis, self.frequencies = response, basis, probe.frequencies
        self.blocks = MeasuredBlocks(
            kinds, response.sequence, probe.slab.refractive_index, response.phasor, response.cosine
        )
        self.mean_model = np.full(len(kinds), 0.001)
        self.white_per_irradiance = probe.paper_reflectance * probe.film_transmittance**2 / np.pi
        self.sheet = SheetFit(
            self.blocks, response, probe.frequencies, basis, self.mean_model, self.white_per_irradiance
        )

    def start(self, means, nuisance=None, count=None):
        count = count or len(self.frequencies)
        self.nuisance = nuisance or Nuisance.guess()
        self.means = means
        self.used = self.sheet.begin(count)
        self.blocks.gather(means, self.used)
        self.response.fill(self.used)
        self.sheet.recall(self.nuisance)
        return self

    def planes(self, name, channel=GREEN):
        """Of a channel, the last axis in the sheet's own order."""
        planes = getattr(self.sheet, name)[channel]
        natural = np.zeros((*planes.shape[:-1], len(self.response.sequence)))
        natural[..., self.response.sequence] = planes[..., : len(self.response.sequence)]
        return natural


@pytest.fixture(scope="session")
def fitted(probe, response, plane):
    return Fitted(probe, response, plane)


class Anywhere:
    """Light that may come from anywhere, whatever a guess says.

    Args:
        frequencies: (k, 2) of the coefficients.
        independent: (m, m) lower triangle that makes coefficients of independent parts; by default each is one.
    """

    def __init__(self, frequencies, independent=None):
        self.frequencies = frequencies
        triangle = np.eye(2 * len(frequencies) - 1) if independent is None else independent
        self.isotropic = LikelyLight.of_covariance(triangle @ triangle.T)

    def as_bright_as(self, _guess):
        return self.isotropic
