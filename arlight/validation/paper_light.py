"""The paper's irradiance under many environments at once: paths made by Mitsuba, put on every point of the sheet."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from arlight.environment import Environment
from arlight.validation.assembled_layers import AssembledLayers
from arlight.validation.stack_paths import StackPaths, trace_stack

Image = NDArray[np.float32]

STEP = 4
"""Fine samples between neighbouring samples of the paper's light."""
_BORDER_MM = 14.0
# what of the products stays in a core's cache
_CHUNK = 256


@dataclass(frozen=True, slots=True)
class GatherSettings:
    """How densely the light is gathered."""

    direct_log2: int = 14
    """2 to this many paths of a paper point go straight to the sky."""
    bounced_log2: int = 11
    """2 to this many begin at each face with a reflection."""
    sets: int = 16
    """Independent sets of paths, taken in turn by the rows: their errors average out within a camera's pixel."""
    seed: int = 0
    """Of all of them."""


def gather_irradiance(
    layers: AssembledLayers, environments: list[Environment], settings: GatherSettings | None = None
) -> Image:
    """Irradiance of the paper, interreflections included.

    Args:
        layers: the assembled sheet.
        environments: the lights.
        settings: how densely.

    Returns:
        (environments, 3, rows, columns) [radiance * sr] at every fourth fine sample of the layers, both ways.

    Raises:
        ValidationUnavailableError: Mitsuba is not there.
    """
    settings = settings or GatherSettings()
    planes = [_Planes.of(image, layers.per_mm) for image in (layers.film, layers.paper)]
    rows, columns = layers.film.shape[0] // STEP, layers.film.shape[1] // STEP
    sets = [
        _PlacedPaths.of(
            trace_stack(layers.slab, settings.direct_log2, settings.bounced_log2, settings.seed * 1000 + k),
            environments,
            layers.per_mm,
        )
        for k in range(settings.sets)
    ]
    out = np.zeros((rows, 3 * len(environments), columns), np.float32)

    def gather(row: int) -> None:
        _gather_row(planes[0], planes[1], sets[row % len(sets)], row, out[row])

    # a row a thread: nobody waits for the others
    with threadpool_limits(1), ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(gather, range(rows)))
    return np.ascontiguousarray(out.transpose(1, 0, 2)).reshape(len(environments), 3, rows, columns)


def radiosity(layers: AssembledLayers, irradiance: Image) -> Image:
    """Radiosity (rows, columns, channels) of the paper at every second fine sample.

    Args:
        layers: the assembled sheet.
        irradiance: (channels, rows, columns) at every fourth fine sample.
    """
    paper = layers.paper[::2, ::2]
    return np.stack([_doubled(plane) * paper for plane in irradiance], axis=-1)


def _gather_row(film: "_Planes", paper: "_Planes", paths: "_PlacedPaths", row: int, out: Image) -> None:
    """Add up the light (channels, columns) of one row."""
    product = np.empty((_CHUNK, out.shape[1]), np.float32)
    for start in range(0, len(paths.film_count), _CHUNK):
        part = slice(start, start + _CHUNK)
        view = product[: len(paths.film_count[part])]
        _film_and_paper(
            film.values, paper.values, row + film.border, film.border,
            paths.film[part], paths.film_count[part], paths.paper[part], paths.paper_count[part], view,
        )  # fmt: skip
        out += paths.light[:, part] @ view


def _doubled(plane: Image) -> Image:
    """Twice the samples each way; the odd ones by a six-tap midpoint filter."""
    taps = np.array([3.0, -25.0, 150.0, 150.0, -25.0, 3.0], np.float32) / 256.0
    one = np.ones(1, np.float32)
    out = np.empty((2 * plane.shape[0], 2 * plane.shape[1]), np.float32)
    across = cv2.sepFilter2D(plane, cv2.CV_32F, taps, one, anchor=(2, 0), borderType=cv2.BORDER_REPLICATE)
    out[::2, ::2], out[::2, 1::2] = plane, across
    even = np.ascontiguousarray(out[::2])
    out[1::2] = cv2.sepFilter2D(even, cv2.CV_32F, one, taps, anchor=(0, 2), borderType=cv2.BORDER_REPLICATE)
    return out


@dataclass(frozen=True, slots=True)
class _Planes:
    """An image on the fine grid, dealt out so that neighbours of one offset lie side by side."""

    values: Image
    """(STEP, STEP, rows, columns): plane [a, b] holds fine samples (STEP r + a, STEP c + b), zeros around."""
    border: int
    """Rows and columns of zeros on every side."""

    @classmethod
    def of(cls, image: Image, per_mm: float) -> "_Planes":
        border = int(np.ceil(_BORDER_MM * per_mm / STEP))
        planes = np.stack([[image[a::STEP, b::STEP] for b in range(STEP)] for a in range(STEP)])
        return cls(np.pad(planes, ((0, 0), (0, 0), (border, border), (border, border))), border)


@dataclass(frozen=True, slots=True)
class _PlacedPaths:
    """Paths as the kernel wants them."""

    film: NDArray[np.int64]
    film_count: NDArray[np.int64]
    paper: NDArray[np.int64]
    paper_count: NDArray[np.int64]
    light: Image
    """(channels, paths): weight times the environments' radiance."""

    @classmethod
    def of(cls, paths: StackPaths, environments: list[Environment], per_mm: float) -> "_PlacedPaths":
        light = np.concatenate([e.radiance_at(paths.direction).T for e in environments]) * paths.weight
        reach = _BORDER_MM - 1.0
        light = light * (np.abs(paths.film_mm).max(axis=(1, 2)) < reach)
        return cls(
            _fine_steps(np.clip(paths.film_mm, -reach, reach), per_mm),
            paths.film_count,
            _fine_steps(np.clip(paths.paper_mm, -reach, reach), per_mm),
            paths.paper_count,
            np.ascontiguousarray(light, np.float32),
        )


def _fine_steps(places_mm: NDArray[np.float64], per_mm: float) -> NDArray[np.int64]:
    """(..., 2) fine samples down and to the right."""
    return np.rint(places_mm[..., ::-1] * [-per_mm, per_mm]).astype(np.int64)


@njit(cache=True, nogil=True, fastmath=True)
def _film_and_paper(film, paper, row, column, film_at, film_count, paper_at, paper_count, out):  # type: ignore[no-untyped-def]
    """out[path, c] = product of film and paper where the path meets them, for the paper points of one row."""
    count, columns = out.shape
    step = film.shape[0]
    for path in range(count):
        target = out[path]
        for k in range(film_count[path]):
            dy, dx = film_at[path, k]
            y, x = row + dy // step, column + dx // step
            source = film[dy % step, dx % step, y, x : x + columns]
            if k == 0:
                for i in range(columns):
                    target[i] = source[i]
            else:
                for i in range(columns):
                    target[i] *= source[i]
        for k in range(paper_count[path]):
            dy, dx = paper_at[path, k]
            y, x = row + dy // step, column + dx // step
            source = paper[dy % step, dx % step, y, x : x + columns]
            for i in range(columns):
                target[i] *= source[i]
