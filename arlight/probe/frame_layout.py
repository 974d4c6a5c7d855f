"""The opaque frame around the block field: its window, fiducials and grey wedge, laid out in whole raster pixels."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil

from arlight.probe.design import Block, Marker, Probe

DICTIONARY = "DICT_4X4_50"
MODULES = 6
"""Modules along a marker's side: four of code and the black border."""
WINDOW_TOLERANCE_MM = 0.5
"""How far the window reaches beyond the block field.

A frame cut or laid half a millimetre off, or thick as card and seen from low, still covers nothing of a block. The film
is black there, so the gap lets in no light.
"""

_MODULE_MM = 2.5
_QUIET_SLACK_MM = 0.1
_MARKER_PITCH_MM = 48.0
# the dictionary has fifty
_MOST_GAPS = 12
_STEP_MM = 9.0
_STEP_GAP_MM = 1.0
_WEDGE_STEPS = 12
_FEWEST_STEPS = 8
# camera blur reaches over the edge of a step
_STEP_WINDOW_SHARE = 0.75
_DARKEST_REFLECTANCE = 0.03


@dataclass(frozen=True, slots=True)
class FrameLayout:
    """The frame around a field, in whole raster pixels where anything is printed."""

    sheet_px: tuple[int, int]
    """Outline, an even number of pixels each way [px]."""
    pixels_per_mm: float
    """Resolution."""
    module_px: int
    """Side of a marker's module [px]."""
    quiet_px: int
    """White between a marker and the outline or the window, a module at least [px]."""

    @property
    def sheet_mm(self) -> tuple[float, float]:
        """Outline [mm]."""
        return self.sheet_px[0] / self.pixels_per_mm, self.sheet_px[1] / self.pixels_per_mm

    @property
    def marker_px(self) -> int:
        """Side of a marker [px]."""
        return MODULES * self.module_px

    def mm(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Probe frame position of a raster position counted from the sheet's top left corner."""
        width, height = self.sheet_px
        return (x_px - width / 2.0) / self.pixels_per_mm, (height / 2.0 - y_px) / self.pixels_per_mm


def frame_around(field_mm: tuple[float, float], pixels_per_mm: float) -> FrameLayout:
    """The frame for a block field of this width and height."""
    module = ceil(_MODULE_MM * pixels_per_mm)
    quiet = module + ceil(_QUIET_SLACK_MM * pixels_per_mm)
    band = 2 * quiet + MODULES * module + ceil(WINDOW_TOLERANCE_MM * pixels_per_mm)
    # three markers along a side, and a step of the wedge between two of them
    shortest = 3 * MODULES * module + 6 * quiet + 2 * ceil(_STEP_MM * pixels_per_mm + 1)
    width, height = (max(2 * (ceil(side / 2.0 * pixels_per_mm) + band), shortest + shortest % 2) for side in field_mm)
    return FrameLayout((width, height), pixels_per_mm, module, quiet)


def window_mm(probe: Probe) -> tuple[float, float]:
    """Width and height of the frame's window: the block field and the tolerance around it."""
    field = [block for block in probe.blocks if block.kind != "wedge"]
    half = [
        max(abs(block.center_mm[axis]) + block.size_mm / 2.0 for block in field) + WINDOW_TOLERANCE_MM
        for axis in (0, 1)
    ]
    return 2.0 * half[0], 2.0 * half[1]


def place_markers(frame: FrameLayout) -> tuple[Marker, ...]:
    """Markers in the corners and at uniform intervals between them, numbered clockwise from the top left."""
    return tuple(
        Marker(number, tuple(frame.mm(*corner) for corner in _square(left, top, frame.marker_px)))
        for number, (left, top) in enumerate(_marker_places(frame))
    )


def place_wedge(frame: FrameLayout, first_id: int) -> tuple[Block, ...]:
    """The steps of the grey wedge, between the markers, clear of their quiet zones.

    Every reflectance stands twice, at points opposite each other about the sheet's centre where the frame has room for
    that, so that light that falls off across the sheet cancels.

    Args:
        frame: where they go.
        first_id: number of the first step.
    """
    places = _step_places(frame)
    paired = len(places) >= 2 * _FEWEST_STEPS
    chosen = places[: len(places) // 2] if paired else places
    values = _reflectances(len(chosen))
    if paired:
        width, height = frame.sheet_px
        chosen, values = chosen + [(width - x, height - y) for x, y in chosen], values * 2
    size = _step_px(frame) / frame.pixels_per_mm
    return tuple(
        Block(first_id + i, "wedge", frame.mm(*place), size, size * _STEP_WINDOW_SHARE, reflectance=value)
        for i, (place, value) in enumerate(zip(chosen, values, strict=True))
    )


def _step_px(frame: FrameLayout) -> int:
    """Side of a wedge step, even so that its centre is a pixel's corner [px]."""
    return 2 * round(_STEP_MM / 2.0 * frame.pixels_per_mm)


def _step_places(frame: FrameLayout) -> list[tuple[int, int]]:
    """Centres of the wedge steps, clockwise from the sheet's top left, the fewest a gap that suffice [px]."""
    width, height = frame.sheet_px
    middle = frame.quiet_px + frame.marker_px // 2
    for most in range(1, _WEDGE_STEPS):
        across, down = _between(frame, width, most), _between(frame, height, most)
        if len(across) + len(down) >= _WEDGE_STEPS:
            break
    return (
        [(x, middle) for x in across]
        + [(width - middle, y) for y in down]
        + [(width - x, height - middle) for x in across]
        + [(middle, height - y) for y in down]
    )


def _between(frame: FrameLayout, side_px: int, most: int) -> list[int]:
    """Centres of steps along a side, evenly in each gap between two markers' quiet zones, at most so many a gap."""
    places: list[int] = []
    step, apart = _step_px(frame), ceil(_STEP_GAP_MM * frame.pixels_per_mm)
    for start, following in pairwise(_side_places(frame, side_px)):
        low, high = start + frame.marker_px + frame.quiet_px, following - frame.quiet_px
        count = min(most, (high - low + apart) // (step + apart))
        blank = (high - low - count * step) / (count + 1)
        places += [low + round((i + 1) * blank + (i + 0.5) * step) for i in range(count)]
    return places


def _reflectances(steps: int) -> list[float]:
    """From white to 3 %, even in lightness: as even in the camera's encoded values as in the eye."""
    dark = _lightness(_DARKEST_REFLECTANCE)
    return [round(((1.0 + (dark - 1.0) * i / (steps - 1) + 0.16) / 1.16) ** 3, 6) for i in range(steps)]


def _lightness(reflectance: float) -> float:
    """CIE lightness on a scale to 1."""
    return 1.16 * reflectance ** (1.0 / 3.0) - 0.16


def _square(left: int, top: int, side: int) -> tuple[tuple[int, int], ...]:
    return (left, top), (left + side, top), (left + side, top + side), (left, top + side)


def _side_places(frame: FrameLayout, side_px: int) -> list[int]:
    """Where markers begin along a side, corner to corner, both included."""
    first, last = frame.quiet_px, side_px - frame.quiet_px - frame.marker_px
    gaps = min(max(2, round((last - first) / (_MARKER_PITCH_MM * frame.pixels_per_mm))), _MOST_GAPS)
    offsets = [round((last - first) * i / gaps) for i in range(gaps // 2 + 1)]
    # mirrored, not rounded again: markers stand symmetric about the sheet's centre
    return [first + o for o in offsets] + [last - o for o in offsets[(gaps - 1) // 2 :: -1]]


def _marker_places(frame: FrameLayout) -> list[tuple[int, int]]:
    """Top left corners of the markers, clockwise from the sheet's top left [px]."""
    width, height = frame.sheet_px
    across, down = _side_places(frame, width), _side_places(frame, height)
    return (
        [(x, down[0]) for x in across[:-1]]
        + [(across[-1], y) for y in down[:-1]]
        + [(x, down[-1]) for x in across[:0:-1]]
        + [(across[0], y) for y in down[:0:-1]]
    )
