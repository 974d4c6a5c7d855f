"""Pixels of the frame's white paper and of its grey wedge, in one picture.

The frame lies on top of everything: no glass, no film, no stripes. What its paper shows is the light that falls on the
sheet, whatever the view.
"""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import ProbeError
from arlight.native import Workspace, address, library
from arlight.probe.design import Probe
from arlight.probe.frame_layout import window_mm
from arlight.tracking.lens import camera_parameters
from arlight.video.frame import Frame
from arlight.video.layout import POINTERS, Layout, PictureCodes, layout_of

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "exposure")
_LIBRARY.locate.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, *([ctypes.c_void_p] * 2)]
_LIBRARY.read_pixels.argtypes = [POINTERS[Layout], POINTERS[PictureCodes], ctypes.c_int, *([ctypes.c_void_p] * 2)]
_LIBRARY.read_pixels.restype = None

_EDGE_PX = 3.0
"""Distance to keep from ink and edges for the blur, the pixel's square and chroma stored at half resolution [px]."""
_LEAST_EDGE_MM = 0.8
_LEAST_PIXELS = 40
_CHUNK = 64
"""Points that are looked at together (paper_samples.h)."""
SECTORS = 24
"""Parts of the frame, by the angle at the sheet's centre."""


@dataclass(frozen=True, slots=True)
class PaperSamples:
    """Pixels of paper and wedge in one picture."""

    points_mm: Array
    """(n, 2) where on the sheet [mm]."""
    pixels: NDArray[np.int32]
    """(n, 2) column and row [px]."""
    encoded: NDArray[np.float32]
    """(n, 3) encoded R'G'B', 1 is full scale."""
    reflectance: Array
    """(n,) relative to white paper: 1 on paper, a step's own on the wedge."""
    patch: NDArray[np.int64]
    """(n,) number of the wedge step; -1 on paper."""
    sector: NDArray[np.int64]
    """(n,) number of the part of the frame; pixels of one part share their errors."""


class _Shared(Workspace):
    """What paper_samples.h calls PaperPoints."""

    _fields_ = (
        ("count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("x", "y", "clearance")),
        ("edge_px", ctypes.c_double),
        ("lens", ctypes.c_void_p),
        ("most", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("place", "pixel")),
    )


class PaperSampler:
    """Finds the paper of a sheet's frame in pictures of one camera.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera.
        spacing_mm: distance of the points that are read [mm].
        most: number of points that suffice; those of a picture are then spread evenly among all that it shows.

    Raises:
        ProbeError: the sheet's frame has no unprinted paper to speak of.
    """

    def __init__(self, probe: Probe, camera: Camera, spacing_mm: float = 0.9, most: int | None = None) -> None:
        wedge = [block for block in probe.blocks if block.kind == "wedge"]
        squares = [np.array(marker.corners_mm) for marker in probe.markers]
        squares += [_square(block.center_mm, block.size_mm) for block in wedge]
        paper, clear = _blank_paper(probe, squares, spacing_mm)
        if len(paper) < _LEAST_PIXELS:
            raise ProbeError("the sheet's frame has no blank paper between its markers; design it with `arlight probe`")
        points, clearance, patch = [paper], [clear], [np.full(len(paper), -1)]
        for number, block in enumerate(wedge):
            grid = _grid(_square(block.center_mm, block.size_mm), spacing_mm)
            points.append(grid)
            clearance.append(_inside_mm(grid, _square(block.center_mm, block.size_mm)))
            patch.append(np.full(len(grid), number))
        order = np.arange(sum(map(len, points)))
        if most is not None:
            # the first that a picture shows are then a fair sample of all
            np.random.default_rng(0).shuffle(order)
        self.points_mm = np.concatenate(points)[order]
        """(n, 2) points of paper and wedge [mm]."""
        self.patch = np.concatenate(patch)[order]
        """(n,) number of the wedge step that they lie on; -1 on paper."""
        steps = np.array([block.reflectance or 0.0 for block in wedge] + [1.0])
        self.reflectance = steps[self.patch]
        """(n,) relative to white paper."""
        angle = np.arctan2(self.points_mm[:, 1], self.points_mm[:, 0])
        self.sector = np.floor((angle / (2.0 * np.pi) + 0.5) * SECTORS).astype(np.int64) % SECTORS
        """(n,) the part of the frame that they lie in."""
        self._place = np.zeros(len(order) if most is None else most, np.int32)
        self._pixel = np.zeros((len(self._place), 2), np.int32)
        self.shared = _Shared(len(order), edge_px=_EDGE_PX, most=len(self._place))
        """The compiled part's view of it."""
        self._share(np.concatenate(clearance)[order], camera)

    def _share(self, clearance: Array, camera: Camera) -> None:
        """Lay out what the compiled part reads and writes."""
        count = len(self.points_mm)
        padded = np.full((3, -(-count // _CHUNK) * _CHUNK), -1.0, np.float32)
        padded[:2, :count], padded[2, :count] = self.points_mm.T, clearance
        places = dict(zip(("x", "y", "clearance"), padded, strict=True))
        self.shared.hold({**places, "lens": camera_parameters(camera), "place": self._place, "pixel": self._pixel})

    @property
    def paper_mm(self) -> Array:
        """(m, 2) the points of blank paper that are sampled where they can be seen [mm]."""
        return self.points_mm[self.patch < 0]

    def sample(self, frame: Frame, pose: Pose) -> PaperSamples:
        """Paper and wedge as one picture shows them; empty where they are out of it or too small in it.

        Args:
            frame: the picture; its size is the camera's.
            pose: camera_from_probe.
        """
        looked = ctypes.c_int32()
        transform = np.concatenate([pose.rotation, pose.translation[None]]).astype(float)
        found = _LIBRARY.locate(
            ctypes.byref(self.shared), *frame.size, address(transform, np.float64), ctypes.byref(looked)
        )
        kept, pixels = self._place[:found], self._pixel[:found].copy()
        return PaperSamples(
            self.points_mm[kept], pixels, read_encoded(frame, pixels), self.reflectance[kept], self.patch[kept],
            self.sector[kept],
        )  # fmt: skip


def read_encoded(frame: Frame, pixels: NDArray[np.integer[Any]]) -> NDArray[np.float32]:
    """Encoded R'G'B' (n, 3) of single pixels (n, 2), chroma as its nearest sample has it; clamped to [0, 1].

    Args:
        frame: the picture.
        pixels: columns and rows inside it [px].
    """
    places, out = np.ascontiguousarray(pixels, np.int32), np.empty((3, len(pixels)), np.float32)
    _LIBRARY.read_pixels(
        layout_of(frame.size, frame.format), frame.places, len(places), address(places, np.int32),
        address(out, np.float32),
    )  # fmt: skip
    return out.T


def _blank_paper(probe: Probe, squares: list[Array], spacing_mm: float) -> tuple[Array, Array]:
    """Points (n, 2) of the frame with nothing printed near, and how far they are from anything else [mm]."""
    half_x, half_y = (side / 2.0 for side in probe.sheet_mm)
    points = _grid(np.array([[-half_x, half_y], [half_x, half_y], [half_x, -half_y], [-half_x, -half_y]]), spacing_mm)
    window = np.array(window_mm(probe)) / 2.0
    beyond = np.abs(points) - window
    clear = np.minimum(_outside_mm(beyond), np.minimum(half_x - abs(points[:, 0]), half_y - abs(points[:, 1])))
    for square in squares:
        centre = square.mean(axis=0)
        half = np.abs(square - centre).max(axis=0)
        clear = np.minimum(clear, _outside_mm(np.abs(points - centre) - half))
    kept = clear > _LEAST_EDGE_MM
    return points[kept], clear[kept]


def _outside_mm(beyond: Array) -> Array:
    """Distance from a rectangle, by how far points (n, 2) lie beyond its sides; negative within."""
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.where(np.any(beyond > 0.0, axis=1), outside, beyond.max(axis=1))


def _inside_mm(points: Array, square: Array) -> Array:
    centre = square.mean(axis=0)
    half = np.abs(square - centre).max(axis=0)
    return np.min(half - np.abs(points - centre), axis=1)


def _square(center_mm: tuple[float, float], size_mm: float) -> Array:
    half = size_mm / 2.0
    return np.array(center_mm) + half * np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])


def _grid(corners: Array, spacing_mm: float) -> Array:
    low, high = corners.min(axis=0), corners.max(axis=0)
    axes = [np.arange(a + spacing_mm / 2.0, b, spacing_mm) for a, b in zip(low, high, strict=True)]
    x, y = np.meshgrid(*axes)
    return np.stack([x.ravel(), y.ravel()], axis=1)
