"""top.png, bottom.png and frame.png: the sheet's layers as 8-bit images of linear values on one pixel grid."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from arlight.errors import OutputError, ProbeError
from arlight.probe import patterns
from arlight.probe.design import Probe
from arlight.probe.patterns import Raster

TOP, BOTTOM, FRAME = "top.png", "bottom.png", "frame.png"


@dataclass(frozen=True, slots=True)
class Rasters:
    """The three printed layers, (rows, columns) each, row 0 at the sheet's +y edge."""

    film: Raster
    """Transmittance relative to the unprinted film, [0, 1]."""
    paper: Raster
    """Reflectance relative to the unprinted paper, [0, 1]."""
    frame: Raster
    """Reflectance of the frame relative to the unprinted paper, [0, 1]."""
    window: NDArray[np.bool_]
    """True where the frame is cut out."""


def render_rasters(probe: Probe) -> Rasters:
    """The layers of a sheet, exact to float32."""
    frame, window = patterns.frame(probe)
    return Rasters(patterns.film(probe), patterns.paper(probe), frame, window)


def write_rasters(rasters: Rasters, pixels_per_mm: float, folder: Path | str) -> list[Path]:
    """Write top.png, bottom.png (grey) and frame.png (grey and alpha, 0 in the window), values linear.

    Args:
        rasters: what to write.
        pixels_per_mm: noted in the images as their resolution.
        folder: an existing folder.

    Raises:
        OutputError: a file cannot be written.
    """
    folder = Path(folder)
    alpha = np.where(rasters.window, 0, 255).astype(np.uint8)
    # white under the window, so that programs that ignore alpha show paper there
    frame = np.where(rasters.window, 255, _to_bytes(rasters.frame)).astype(np.uint8)
    images = {
        TOP: Image.fromarray(_to_bytes(rasters.film)),
        BOTTOM: Image.fromarray(_to_bytes(rasters.paper)),
        FRAME: Image.merge("LA", (Image.fromarray(frame), Image.fromarray(alpha))),
    }
    dots_per_inch = pixels_per_mm * 25.4
    for name, image in images.items():
        try:
            image.save(folder / name, compress_level=9, dpi=(dots_per_inch, dots_per_inch))
        except OSError as error:
            raise OutputError(
                f"{folder / name}: cannot be written ({error.strerror}); choose another folder"
            ) from error
    return [folder / name for name in images]


def read_rasters(probe: Probe, folder: Path | str) -> Rasters:
    """Read the three images that stand beside a probe.json.

    Raises:
        ProbeError: one is missing, not an image, not 8-bit, or not on the sheet's pixel grid.
    """
    folder = Path(folder)
    film, paper = (_read_grey(folder / name, probe) for name in (TOP, BOTTOM))
    image = _read(folder / FRAME, probe)
    if image.ndim != 3 or image.shape[2] != 4:
        raise ProbeError(f"{folder / FRAME}: expected an image with alpha, 0 in the frame's window; found none")
    return Rasters(film, paper, _grey(image), image[..., 3] < 128)


def _to_bytes(values: Raster) -> NDArray[np.uint8]:
    return np.round(values * 255.0).astype(np.uint8)


def _read_grey(path: Path, probe: Probe) -> Raster:
    return _grey(_read(path, probe))


def _grey(image: NDArray[np.uint8]) -> Raster:
    channel = image if image.ndim == 2 else image[..., 1]
    return channel.astype(np.float32) / np.float32(255.0)


def _read(path: Path, probe: Probe) -> NDArray[np.uint8]:
    if not path.is_file():
        raise ProbeError(f"{path}: no such file; the sheet's raster is expected beside its probe.json")
    try:
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.dtype != np.uint8:
        raise ProbeError(f"{path}: expected an 8-bit PNG, found something else; write the probe again")
    rows, columns = patterns.raster_shape(probe)
    if image.shape[:2] != (rows, columns):
        raise ProbeError(
            f"{path}: expected {columns} x {rows} pixels ({probe.pixels_per_mm:g} per mm), found {image.shape[1]} x "
            f"{image.shape[0]}; it belongs to another sheet"
        )
    return image.astype(np.uint8, copy=False)
