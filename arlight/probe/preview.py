"""A picture of the assembled sheet as it looks from straight above under an even sky."""

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from arlight.color import encoded_from_linear
from arlight.probe.design import Probe
from arlight.probe.patterns import Raster
from arlight.probe.rasters import Rasters

_PIXELS_PER_MM = 6.0
_LONGEST_PX = 2000
_MARGIN_MM = 12.0
_TABLE_RGB = (0.16, 0.105, 0.065)
_SHADOW_MM = (2.5, 3.5)
_SKY_RINGS = 4


def preview_image(probe: Probe, rasters: Rasters) -> Image.Image:
    """The sheet lying on a table, sRGB.

    Args:
        probe: the sheet.
        rasters: its layers.

    Returns:
        An RGB image of at most about 2000 pixels a side.
    """
    scale = min(_PIXELS_PER_MM, probe.pixels_per_mm, _LONGEST_PX / max(probe.sheet_mm))
    size = (round(probe.sheet_mm[0] * scale), round(probe.sheet_mm[1] * scale))
    film, paper, frame, cut = (
        cv2.resize(layer, size, interpolation=cv2.INTER_AREA)
        for layer in (rasters.film, rasters.paper, rasters.frame, rasters.window.astype(np.float32))
    )
    lit = _light_through(film * cut, probe, scale)
    seen = probe.film_transmittance**2 * film * lit * paper
    sheet = probe.paper_reflectance * (cut * seen + (1.0 - cut) * frame)
    return Image.fromarray(_on_table(sheet.astype(np.float32), scale))


def _light_through(film: Raster, probe: Probe, scale: float) -> Raster:
    """Share of an even sky's light that reaches the paper through the film around each point."""
    radius = (np.arange(_SKY_RINGS) + 0.5) / (2.0 * _SKY_RINGS)
    lit, total = np.zeros_like(film), 0.0
    for ring, r in enumerate(radius):
        count = 6 * ring + 4
        angle = 2.0 * np.pi * np.arange(count) / count
        offsets = r * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        weight = float(probe.slab.received_weight(offsets[0])) * r / count
        for delta in offsets:
            dx, dy = delta * probe.slab.period_mm * scale
            # the paper at p is lit through the film at p + D; rows run down, y up
            shift = np.array([[1.0, 0.0, -dx], [0.0, 1.0, dy]])
            lit += weight * cv2.warpAffine(film, shift, film.shape[::-1])
            total += weight
    return (lit / total).astype(np.float32)


def _on_table(sheet: Raster, scale: float) -> NDArray[np.uint8]:
    margin = round(_MARGIN_MM * scale)
    rows, columns = sheet.shape
    table = np.ones((rows + 2 * margin, columns + 2 * margin, 3), np.float32) * np.array(_TABLE_RGB, np.float32)
    dx, dy = (round(offset * scale) for offset in _SHADOW_MM)
    shade = np.zeros(table.shape[:2], np.float32)
    shade[margin + dy : margin + dy + rows, margin + dx : margin + dx + columns] = 0.6
    table *= 1.0 - cv2.GaussianBlur(shade, (0, 0), 1.5 * scale)[..., None]
    table[margin : margin + rows, margin : margin + columns] = sheet[..., None]
    return np.round(encoded_from_linear(table) * 255.0).astype(np.uint8)
