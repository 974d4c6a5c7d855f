"""Layers of a sheet as it was printed and put together: drawn exactly, then toned, blurred and laid where they lie."""

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.probe.assembly import Assembly, Print
from arlight.probe.design import Probe
from arlight.probe.rasters import Rasters, render_rasters
from arlight.synthetic.sheet import SheetLayers

Image = NDArray[np.float32]


def assembled_layers(probe: Probe, assembly: Assembly) -> SheetLayers:
    """Film and paper of an assembled sheet; its frame, which carries the fiducials, is the probe frame itself.

    Corrections of single blocks are what the model of the layers leaves over, and are not drawn.
    """
    rasters = render_rasters(probe)
    film, paper = (
        _made(layer, made, probe) for layer, made in ((rasters.film, assembly.film), (rasters.paper, assembly.paper))
    )
    return SheetLayers.from_rasters(probe, Rasters(film, paper, rasters.frame, rasters.window))


def _made(raster: Image, made: Print, probe: Probe) -> Image:
    """What the printer makes of a raster, laid in the probe frame; unprinted beyond its border."""
    toned = made.tone(raster).astype(np.float32)
    sigma = made.blur_mm * probe.pixels_per_mm
    if sigma > 0.0:
        toned = np.asarray(cv2.GaussianBlur(toned, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE), np.float32)
    # pixel of the design = matrix^-1 (pixel of the sheet - shift), with y up on the sheet and down in the raster
    place = made.registration
    flip = np.diag([1.0, -1.0])
    linear = flip @ place.matrix @ flip
    middle = (np.array(raster.shape[::-1]) - 1.0) / 2.0
    shift_px = flip @ np.array(place.shift_mm) * probe.pixels_per_mm
    forward = np.column_stack([linear, middle + shift_px - linear @ middle])
    return np.asarray(
        cv2.warpAffine(
            toned,
            forward,
            raster.shape[::-1],
            flags=cv2.INTER_LANCZOS4,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=1.0,
        ),
        np.float32,
    ).clip(0.0, 1.0)
