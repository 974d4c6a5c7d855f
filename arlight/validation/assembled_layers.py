"""The layers of an assembled sheet as they really are: halftoned, printed with dot gain, blurred, and laid aside."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from arlight.optics import Slab
from arlight.probe.assembly import Assembly, Print
from arlight.probe.design import Probe
from arlight.probe.frame_layout import window_mm
from arlight.probe.rasters import Rasters, render_rasters

Image = NDArray[np.float32]

FINE_PER_MM = 40.0
"""Samples of film and paper; four along each side of a sample of the paper's light."""


@dataclass(frozen=True, slots=True)
class AssembledLayers:
    """Film, paper and frame in the probe frame. Sample (r, c) of film and paper lies at first_mm + (c, -r) / per_mm."""

    film: Image
    """(rows, columns) transmittance of the film, 0 under the opaque frame."""
    paper: Image
    """(rows, columns) reflectance of the paper."""
    first_mm: tuple[float, float]
    """(x, y) of sample [0, 0] [mm]."""
    per_mm: float
    """Samples of film and paper [1/mm]."""
    frame: Image
    """Reflectance of the frame on the probe's own raster, negative in its window."""
    frame_per_mm: float
    """Resolution of the frame's raster."""
    slab: Slab
    """The glass as it is."""


def assembled_layers(probe: Probe, assembly: Assembly, halftone_dpi: float | None = 600.0) -> AssembledLayers:
    """Print and lay a sheet.

    Args:
        probe: what was designed.
        assembly: what became of it.
        halftone_dpi: resolution of a bilevel printer, error diffused; None for continuous tone.

    Returns:
        The layers around the window, as far as light and views reach.
    """
    slab = assembly.slab(probe)
    half = np.array(window_mm(probe)) / 2.0 + slab.max_offset_mm + 0.5
    count = 4 * np.ceil(half * FINE_PER_MM / 2.0).astype(int)
    first = -count / 2.0 / FINE_PER_MM * np.array([1.0, -1.0])
    per_mm = FINE_PER_MM if halftone_dpi is None else halftone_dpi / 25.4
    rasters = render_rasters(replace(probe, pixels_per_mm=per_mm))
    film, paper = (
        _laid(_printed(raster, printing, per_mm, halftone_dpi is not None), probe, printing, per_mm, first, count)
        for raster, printing in ((rasters.film, assembly.film), (rasters.paper, assembly.paper))
    )
    film *= _opening(probe, first, count) * np.float32(probe.film_transmittance)
    return AssembledLayers(
        film,
        paper * np.float32(probe.paper_reflectance),
        (float(first[0]), float(first[1])),
        FINE_PER_MM,
        _frame(render_rasters(probe), probe),
        probe.pixels_per_mm,
        slab,
    )


def halftoned(clear: Image) -> Image:
    """0 or 1 for every printer pixel by error diffusion (Floyd and Steinberg), row by row in alternate directions."""
    out = np.array(clear, np.float32)
    _diffuse_errors(out)
    return out


def _printed(raster: Image, printing: Print, per_mm: float, halftone: bool) -> Image:
    """What the print of a raster leaves of the light, on the printer's grid."""
    tone = printing.tone(raster)
    if halftone:
        clear = (tone - printing.solid) / (1.0 - printing.solid)
        dots = halftoned(clear.astype(np.float32)).astype(float)
        tone = printing.solid + (1.0 - printing.solid) * dots
    image = tone.astype(np.float32)
    if printing.blur_mm > 0.0:
        image = np.asarray(
            cv2.GaussianBlur(image, (0, 0), printing.blur_mm * per_mm, borderType=cv2.BORDER_REPLICATE), np.float32
        )
    return image


def _laid(
    image: Image, probe: Probe, printing: Print, per_mm: float, first: NDArray[np.float64], count: NDArray[np.int64]
) -> Image:
    """A print, resampled to the fine grid of the probe frame."""
    corners = first + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]]) / FINE_PER_MM
    design = printing.registration.design_points(corners)
    pixels = (design * [1.0, -1.0] + np.array(probe.sheet_mm) / 2.0) * per_mm - 0.5
    matrix = np.stack([pixels[1] - pixels[0], pixels[2] - pixels[0], pixels[0]], axis=1)
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    size = (int(count[0]), int(count[1]))
    laid = cv2.warpAffine(image, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.clip(np.asarray(laid, np.float32), 0.0, 1.0)


def _opening(probe: Probe, first: NDArray[np.float64], count: NDArray[np.int64]) -> Image:
    """1 in the frame's window, 0 under the frame."""
    half = np.array(window_mm(probe)) / 2.0
    x = first[0] + np.arange(count[0]) / FINE_PER_MM
    y = first[1] - np.arange(count[1]) / FINE_PER_MM
    return np.outer(np.abs(y) < half[1], np.abs(x) < half[0]).astype(np.float32)


def _frame(rasters: Rasters, probe: Probe) -> Image:
    frame = rasters.frame * np.float32(probe.paper_reflectance)
    return np.where(rasters.window, np.float32(-1.0), frame)


@njit(cache=True, nogil=True)
def _diffuse_errors(image):  # type: ignore[no-untyped-def]
    rows, columns = image.shape
    for row in range(rows):
        step = 1 if row % 2 == 0 else -1
        column = 0 if step == 1 else columns - 1
        for _ in range(columns):
            wanted = image[row, column]
            value = np.float32(1.0) if wanted >= np.float32(0.5) else np.float32(0.0)
            error = wanted - value
            image[row, column] = value
            ahead, behind = column + step, column - step
            if 0 <= ahead < columns:
                image[row, ahead] += error * np.float32(7 / 16)
                if row + 1 < rows:
                    image[row + 1, ahead] += error * np.float32(1 / 16)
            if row + 1 < rows:
                image[row + 1, column] += error * np.float32(5 / 16)
                if 0 <= behind < columns:
                    image[row + 1, behind] += error * np.float32(3 / 16)
            column += step
