"""What is printed: the film's transmittance, the paper's reflectance and the frame, as linear pixel arrays.

Rasters are (rows, columns); row 0 is the sheet's +y edge, and pixel (row, column) samples the pattern at its centre,
((column + 1/2)/ppm - width/2, height/2 - (row + 1/2)/ppm) [mm]. Values are relative to the unprinted film and paper.
The patterns' phases are global: x is counted from the sheet's centre, not the block's.
"""

from math import ceil

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.probe.design import Block, Design, Marker, Probe
from arlight.probe.frame_layout import window_mm

Raster = NDArray[np.float32]

_FILM_BLACK = ("black_white", "black_black")
_PAPER_BLACK = ("clear_black", "black_black")


def film(probe: Probe) -> Raster:
    """Transmittance of the film relative to the unprinted film, in [0, 1].

    Around the block field the film is black, one period beyond the frame's window: in the gap that a frame cut or laid
    a little off leaves, and through the frame, which is translucent if it is of ordinary paper, no light enters beside
    the blocks. Farther out nothing reaches them, and the film is clear.
    """
    raster = np.ones(raster_shape(probe), np.float32)
    width, height = (side + 2.0 * probe.slab.period_mm for side in window_mm(probe))
    raster[_rectangle(probe, width, height)] = 0.0
    for block in _field(probe):
        rows, columns = block_pixels(probe, block)
        if block.frequency is None:
            raster[rows, columns] = 0.0 if block.kind in _FILM_BLACK else 1.0
        else:
            raster[rows, columns] = film_transmittance(stripe_phase(probe, block, rows, columns), probe.design)
    return raster


def paper(probe: Probe) -> Raster:
    """Reflectance of the paper relative to the unprinted paper, in [0, 1]; white outside the block field."""
    raster = np.ones(raster_shape(probe), np.float32)
    for block in _field(probe):
        rows, columns = block_pixels(probe, block)
        if block.frequency is None or block.phase_deg is None:
            raster[rows, columns] = 0.0 if block.kind in _PAPER_BLACK else 1.0
        else:
            phase = stripe_phase(probe, block, rows, columns)
            raster[rows, columns] = paper_reflectance(phase, np.radians(block.phase_deg), probe.design)
    return raster


def frame(probe: Probe) -> tuple[Raster, NDArray[np.bool_]]:
    """The frame's reflectance relative to the unprinted paper, and where its window is (True)."""
    reflectance = np.ones(raster_shape(probe), np.float32)
    for block in probe.blocks:
        if block.reflectance is not None:
            reflectance[block_pixels(probe, block)] = block.reflectance
    for marker in probe.markers:
        _draw_marker(reflectance, marker, probe)
    window = np.zeros(raster_shape(probe), bool)
    width, height = window_mm(probe)
    window[_rectangle(probe, width, height)] = True
    return reflectance, window


def film_transmittance(phase: Raster, design: Design) -> Raster:
    """f at the phase 2 pi n.x/P [rad]. Source: section 3 for `doubled`."""
    wave = np.cos(phase) if design == "matched" else -np.sin(phase)
    return ((1.0 + wave) / 2.0).astype(np.float32)


def paper_reflectance(phase: Raster, tau: float, design: Design) -> Raster:
    """g at the phase 2 pi n.x/P, ahead of the film by tau [rad]. Source: section 3 for `doubled`."""
    wave = np.cos(phase + tau) if design == "matched" else np.sin(2.0 * phase + tau)
    return ((1.0 + wave) / 2.0).astype(np.float32)


def raster_shape(probe: Probe) -> tuple[int, int]:
    """(rows, columns) of the sheet's rasters."""
    width, height = (round(side * probe.pixels_per_mm) for side in probe.sheet_mm)
    return height, width


def _field(probe: Probe) -> list[Block]:
    return [block for block in probe.blocks if block.kind != "wedge"]


def block_pixels(probe: Probe, block: Block) -> tuple[slice, slice]:
    """Rows and columns of the sheet's rasters whose pixel centres lie in the block."""
    (x, y), half = block.center_mm, block.size_mm / 2.0
    return _span(probe, -y - half, block.size_mm, 1), _span(probe, x - half, block.size_mm, 0)


def _rectangle(probe: Probe, width_mm: float, height_mm: float) -> tuple[slice, slice]:
    """Rows and columns of a rectangle in the middle of the sheet."""
    return _span(probe, -height_mm / 2.0, height_mm, 1), _span(probe, -width_mm / 2.0, width_mm, 0)


def _span(probe: Probe, start_mm: float, length_mm: float, axis: int) -> slice:
    """Pixels with centres in [start, start + length), from the sheet's centre along +x (axis 0) or -y (axis 1)."""
    edges = (np.array([start_mm, start_mm + length_mm]) + probe.sheet_mm[axis] / 2.0) * probe.pixels_per_mm - 0.5
    # rounded first: neighbours whose common edge differs by rounding leave no line between them
    first, end = (ceil(edge) for edge in np.round(edges, 5))
    return slice(max(first, 0), max(end, 0))


def stripe_phase(probe: Probe, block: Block, rows: slice, columns: slice) -> Raster:
    """phi = 2 pi n.x/P at pixel centres [rad]."""
    assert block.frequency is not None
    u, v = block.frequency
    x = (np.arange(columns.start, columns.stop) + 0.5) / probe.pixels_per_mm - probe.sheet_mm[0] / 2.0
    y = probe.sheet_mm[1] / 2.0 - (np.arange(rows.start, rows.stop) + 0.5) / probe.pixels_per_mm
    turns = (u * x[None, :] + v * y[:, None]) / probe.slab.period_mm
    return (2.0 * np.pi * (turns % 1.0)).astype(np.float32)


def _draw_marker(raster: Raster, marker: Marker, probe: Probe) -> None:
    """The marker's modules at the pixels whose centres lie on it, at whatever turn it stands."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, probe.dictionary))
    modules = dictionary.markerSize + 2
    code = cv2.aruco.generateImageMarker(dictionary, marker.id, modules)
    corners = (np.array(marker.corners_mm) - (-probe.sheet_mm[0] / 2.0, probe.sheet_mm[1] / 2.0)) * (
        probe.pixels_per_mm * np.array([1.0, -1.0])
    )
    low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    offset = np.stack([x, y], axis=-1) - corners[0]
    across, down = ((offset @ side) / (side @ side) for side in (corners[1] - corners[0], corners[3] - corners[0]))
    column, row = (np.floor(share * modules + 1e-9).astype(int) for share in (across, down))
    inside = (column >= 0) & (column < modules) & (row >= 0) & (row < modules)
    part = raster[low[1] : high[1], low[0] : high[0]]
    part[inside] = code[row[inside], column[inside]] / 255.0
