"""The printed layers of a sheet as the light meets them: absolute transmittance and reflectance on one pixel grid."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.errors import ProbeError
from arlight.probe.design import Probe
from arlight.probe.rasters import Rasters, render_rasters

Image = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class SheetLayers:
    """Film, paper and frame; row 0 is the +y edge, pixel (r, c) has its centre at ((c + 1/2), -(r + 1/2)) pixels
    from the sheet's top left corner."""

    film: Image
    """(rows, columns) transmittance of the film, 0 under the opaque frame."""
    paper: Image
    """(rows, columns) reflectance of the paper."""
    frame: Image
    """(rows, columns) reflectance of the frame, 0 in its window."""
    opening: Image
    """(rows, columns) 1 in the frame's window, 0 on the frame."""
    pixels_per_mm: float
    """Resolution of the grid."""

    def __post_init__(self) -> None:
        shapes = {layer.shape for layer in (self.film, self.paper, self.frame, self.opening)}
        if len(shapes) != 1:
            raise ProbeError(f"film, paper and frame must share one pixel grid, found the sizes {sorted(shapes)}")

    @classmethod
    def from_rasters(cls, probe: Probe, rasters: Rasters) -> "SheetLayers":
        """Layers of a probe from its rasters, which are relative to unprinted film and paper.

        Raises:
            ProbeError: the rasters differ in size.
        """
        opening = rasters.window.astype(np.float32)
        if len({layer.shape for layer in (rasters.film, rasters.paper, rasters.frame, opening)}) != 1:
            raise ProbeError("film, paper and frame must share one pixel grid; write the probe again")
        return cls(
            film=rasters.film * np.float32(probe.film_transmittance) * opening,
            paper=rasters.paper * np.float32(probe.paper_reflectance),
            frame=rasters.frame * np.float32(probe.paper_reflectance) * (1.0 - opening),
            opening=opening,
            pixels_per_mm=probe.pixels_per_mm,
        )

    @classmethod
    def of_probe(cls, probe: Probe) -> "SheetLayers":
        """Layers of a probe, drawn from its design."""
        return cls.from_rasters(probe, render_rasters(probe))

    @property
    def size_mm(self) -> tuple[float, float]:
        """(width, height) of the grid [mm]."""
        rows, columns = self.film.shape
        return columns / self.pixels_per_mm, rows / self.pixels_per_mm


def sharpen_for_bilinear(image: Image) -> Image:
    """Samples whose bilinear interpolation has, on the average, the amplitude of the sampled pattern.

    Bilinear reading multiplies the amplitude at x cycles a sample by sinc(x)^2, 4.5 % at 8.5 samples a period. The five
    taps equal 1/sinc(x)^2 up to x^4.
    """
    first, second = 23.0 / 90.0, -1.0 / 45.0
    taps = np.array([-second / 2, -first / 2, 1 + first + second, -first / 2, -second / 2], np.float32)
    return np.asarray(cv2.sepFilter2D(image, cv2.CV_32F, taps, taps, borderType=cv2.BORDER_REPLICATE), np.float32)
