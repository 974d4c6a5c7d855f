"""What a sheet is: blocks, fiducials, and the stack they are printed on. Lengths in millimetres, probe frame."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from arlight.fourier import half_plane_frequencies
from arlight.optics import Slab

Array = NDArray[np.float64]
Design = Literal["matched", "doubled"]
BlockKind = Literal["pattern", "clear_white", "clear_black", "black_white", "black_black", "wedge"]

DESIGNS: tuple[Design, ...] = get_args(Design)
BLOCK_KINDS: tuple[BlockKind, ...] = get_args(BlockKind)


@dataclass(frozen=True, slots=True)
class Block:
    """A square of the sheet with one pattern, or none."""

    id: int
    """Number of the block, unique on the sheet."""
    kind: BlockKind
    """`pattern`; an unpatterned region, named film then paper; or a step of the grey `wedge` on the frame."""
    center_mm: tuple[float, float]
    """Centre (x, y) in the probe frame [mm]."""
    size_mm: float
    """Side of the printed square [mm]."""
    window_mm: float
    """Side of the part that is free of its neighbours' light for every viewer the sheet is made for [mm]."""
    frequency: tuple[int, int] | None = None
    """(u, v) of a `pattern`, else None."""
    phase_deg: float | None = None
    """tau, the paper pattern's phase ahead of the film's [deg], for a `pattern`, else None."""
    reflectance: float | None = None
    """Reflectance of a `wedge` step, relative to the paper, else None."""


@dataclass(frozen=True, slots=True)
class Marker:
    """An ArUco fiducial on the frame."""

    id: int
    """Its number in the dictionary."""
    corners_mm: tuple[tuple[float, float], ...]
    """Four corners (x, y) in the probe frame [mm], in ArUco's order: clockwise from the marker's top left."""


@dataclass(frozen=True)
class Probe:
    """A sheet: what is printed on it and how thick the glass between film and paper is."""

    design: Design
    """`matched`: film and paper with one frequency, four phases; `doubled`: the paper's design, two phases."""
    order: int
    """Highest order |n| of the light's frequencies on the sheet, 1 to 8."""
    sheet_mm: tuple[float, float]
    """Width and height of the frame's outline [mm]."""
    pixels_per_mm: float
    """Resolution of the rasters."""
    glass_mm: float
    """Thickness of the glass [mm]."""
    refractive_index: float
    """Refractive index of the glass."""
    dictionary: str
    """Name of the ArUco dictionary, such as DICT_4X4_50."""
    markers: tuple[Marker, ...]
    """Fiducials on the frame."""
    blocks: tuple[Block, ...]
    """Blocks of the field and steps of the wedge."""
    paper_reflectance: float = 0.9
    """Reflectance of the unprinted paper."""
    film_transmittance: float = 0.95
    """Transmittance of the unprinted film."""

    @cached_property
    def slab(self) -> Slab:
        """The glass between film and paper."""
        return Slab(self.glass_mm, self.refractive_index)

    @cached_property
    def frequencies(self) -> NDArray[np.int64]:
        """(k, 2) frequencies that the sheet measures, (0, 0) first."""
        return half_plane_frequencies(self.order)

    @cached_property
    def outline_mm(self) -> Array:
        """(4, 3) corners of the sheet in the probe frame, clockwise from the top left [mm]."""
        x, y = self.sheet_mm[0] / 2.0, self.sheet_mm[1] / 2.0
        return np.array([[-x, y, 0.0], [x, y, 0.0], [x, -y, 0.0], [-x, -y, 0.0]])
