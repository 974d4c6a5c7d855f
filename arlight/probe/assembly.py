"""What a sheet became when it was printed and put together: the layers' registration, their prints, the glass.

A design is drawn exactly; printers blur it, let dots grow and leave ink that is not black, and hands lay film and
paper a little aside. All of it is known to a simulator and estimated by calibration.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import ProbeError
from arlight.optics import Slab
from arlight.probe.design import Probe

Array = NDArray[np.float64]

_GREATEST_DOT_GAIN = 0.25


@dataclass(frozen=True, slots=True)
class Registration:
    """Where a layer lies: the design's point x is found at shift + scale * rotation(x) in the probe frame."""

    shift_mm: tuple[float, float] = (0.0, 0.0)
    """Where the design's centre lies [mm]."""
    rotation_deg: float = 0.0
    """Rotation about the design's centre, counterclockwise seen from above [deg]."""
    scale: float = 1.0
    """Size relative to the design's."""

    def __post_init__(self) -> None:
        if not (np.all(np.isfinite([*self.shift_mm, self.rotation_deg])) and 0.5 < self.scale < 2.0):
            raise ProbeError(f"a layer's registration must be finite and its scale near 1, found {self}")

    @property
    def matrix(self) -> Array:
        """(2, 2) scale times rotation: probe-frame vectors of design vectors."""
        angle = np.deg2rad(self.rotation_deg)
        return self.scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def design_points(self, points_mm: ArrayLike) -> Array:
        """Which points of the design lie at points (..., 2) of the probe frame [mm]."""
        return (np.asarray(points_mm, float) - self.shift_mm) @ np.linalg.inv(self.matrix).T

    def cycles_per_mm(self, design_cycles_per_mm: ArrayLike) -> Array:
        """Frequencies (..., 2) in the probe frame of stripes that were designed with the given ones [1/mm]."""
        return np.asarray(design_cycles_per_mm, float) @ np.linalg.inv(self.matrix)


@dataclass(frozen=True, slots=True)
class Print:
    """A printed layer."""

    registration: Registration = field(default_factory=Registration)
    """Where it lies."""
    blur_mm: float = 0.0
    """Standard deviation of the Gaussian by which ink and paper blur the print [mm]."""
    dot_gain: float = 0.0
    """How much more than half is covered where half should be, 0 to 0.25; the Murray-Davies gain at 50 %."""
    solid: float = 0.0
    """What solid ink still transmits or reflects, relative to the unprinted layer, 0 to 1."""

    def __post_init__(self) -> None:
        if not (0.0 <= self.blur_mm < np.inf):
            raise ProbeError(f"blur_mm must be a standard deviation in millimetres, 0 or more, found {self.blur_mm}")
        if not abs(self.dot_gain) <= _GREATEST_DOT_GAIN:
            raise ProbeError(f"dot_gain must lie within {_GREATEST_DOT_GAIN} of 0, found {self.dot_gain}")
        if not 0.0 <= self.solid < 1.0:
            raise ProbeError(f"solid ink must leave a share in [0, 1), found {self.solid}")

    def tone(self, value: ArrayLike) -> Array:
        """What the print makes of design values in [0, 1] (1 unprinted, 0 solid), before blur.

        Coverage a = 1 - value grows to a + 4 gain a (1 - a), a parabola with the stated gain at half coverage.
        """
        clear = np.asarray(value, float)
        grown = clear - 4.0 * self.dot_gain * clear * (1.0 - clear)
        return self.solid + (1.0 - self.solid) * grown


@dataclass(frozen=True, slots=True)
class BlockCorrections:
    """What single blocks do beside the layers' model, as a correction of their paper's pattern; arrays by block."""

    gain: Array
    """(blocks,) factor on all that the paper reflects."""
    offset: Array
    """(blocks,) reflectance added to the paper's mean, relative to the unprinted paper."""
    modulation: Array
    """(blocks,) factor on the paper's stripes."""
    phase_deg: Array
    """(blocks,) the paper's stripes ahead of where the layers' registration has them [deg]."""

    def __post_init__(self) -> None:
        fields = (self.gain, self.offset, self.modulation, self.phase_deg)
        if len({np.shape(values) for values in fields}) != 1 or not all(np.all(np.isfinite(v)) for v in fields):
            raise ProbeError("a sheet's block corrections must be finite and as many of each kind as there are blocks")


@dataclass(frozen=True, slots=True)
class Assembly:
    """Film, paper and glass as they are; the default is exactly what was designed."""

    film: Print = field(default_factory=Print)
    """The transparency."""
    paper: Print = field(default_factory=Print)
    """The paper."""
    glass_scale: float = 1.0
    """Thickness of the glass relative to the probe's."""
    blocks: BlockCorrections | None = None
    """Corrections of single blocks, in the order of the sheet's field."""

    def __post_init__(self) -> None:
        if not 0.5 < self.glass_scale < 2.0:
            raise ProbeError(f"glass_scale must lie near 1, found {self.glass_scale}")

    def slab(self, probe: Probe) -> Slab:
        """The glass as it is. Patterns keep the period of the glass that they were designed for."""
        return Slab(probe.glass_mm * self.glass_scale, probe.refractive_index)
