"""Pixels of the frame's white paper and of its grey wedge, in one picture.

The frame lies on top of everything: no glass, no film, no stripes. What its paper shows is the light that falls on the
sheet, whatever the view.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import ProbeError
from arlight.probe.design import Probe
from arlight.probe.frame_layout import window_mm
from arlight.video.conversion import decoding_table
from arlight.video.frame import Frame

Array = NDArray[np.float64]

_EDGE_PX = 3.0
"""Distance to keep from ink and edges for the blur, the pixel's square and chroma stored at half resolution [px]."""
_LEAST_EDGE_MM = 0.8
_LEAST_PIXELS = 40


@dataclass(frozen=True, slots=True)
class PaperSamples:
    """Pixels of paper and wedge in one picture."""

    points_mm: Array
    """(n, 2) where on the sheet [mm]."""
    pixels: NDArray[np.int64]
    """(n, 2) column and row [px]."""
    encoded: Array
    """(n, 3) encoded R'G'B', 1 is full scale."""
    reflectance: Array
    """(n,) relative to white paper: 1 on paper, a step's own on the wedge."""
    patch: NDArray[np.int64]
    """(n,) number of the wedge step; -1 on paper."""
    sector: NDArray[np.int64]
    """(n,) number of the part of the frame; pixels of one part share their errors."""


class PaperSampler:
    """Reads the paper of a sheet's frame in pictures of one camera.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera.
        spacing_mm: distance of the points that are read [mm].

    Raises:
        ProbeError: the sheet's frame has no unprinted paper to speak of.
    """

    def __init__(self, probe: Probe, camera: Camera, spacing_mm: float = 0.9) -> None:
        self._camera = camera
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
        self._points = np.concatenate(points)
        self._clearance = np.concatenate(clearance)
        self._patch = np.concatenate(patch)
        steps = np.array([block.reflectance or 0.0 for block in wedge] + [1.0])
        self._reflectance = steps[self._patch]
        angle = np.arctan2(self._points[:, 1], self._points[:, 0])
        self._sector = np.floor((angle / (2.0 * np.pi) + 0.5) * 24.0).astype(np.int64) % 24

    @property
    def paper_mm(self) -> Array:
        """(m, 2) the points of blank paper that are sampled where they can be seen [mm]."""
        return self._points[self._patch < 0]

    def sample(self, frame: Frame, pose: Pose) -> PaperSamples:
        """Paper and wedge as one picture shows them; empty where they are out of it or too small in it.

        Args:
            frame: the picture; its size is the camera's.
            pose: camera_from_probe.
        """
        space = np.column_stack([self._points, np.zeros(len(self._points))])
        places = self._camera.project(pose, space)
        depth = pose.transform(space)[:, 2]
        at = np.rint(np.where(np.isfinite(places), places, -1.0)).astype(np.int64)
        inside = np.all((at >= 1) & (at < np.array(frame.size) - 1), axis=1)
        margin_mm = _EDGE_PX / np.maximum(self._narrow_px_per_mm(pose, space), 1e-9)
        kept = inside & (depth > 0.0) & (self._clearance > margin_mm)
        at = at[kept]
        return PaperSamples(
            self._points[kept], at, read_encoded(frame, at), self._reflectance[kept], self._patch[kept],
            self._sector[kept],
        )  # fmt: skip

    def _narrow_px_per_mm(self, pose: Pose, space: Array) -> Array:
        """(n,) how many pixels a millimetre of the sheet takes up the narrow way across, without lens distortion."""
        matrix = self._camera.camera_matrix
        seen = pose.transform(space)
        sight, scale = seen[:, :2] / seen[:, 2:], np.diag(matrix)[:2] / seen[:, 2:]
        right, up = (scale * (pose.rotation[:2, k] - sight * pose.rotation[2, k]) for k in range(2))
        area = np.abs(right[:, 0] * up[:, 1] - right[:, 1] * up[:, 0])
        narrow: Array = area / np.sqrt(np.maximum(np.sum(right**2, axis=1) + np.sum(up**2, axis=1), 1e-30))
        return narrow


def read_encoded(frame: Frame, pixels: NDArray[np.int64]) -> Array:
    """Encoded R'G'B' (n, 3) of single pixels (n, 2), chroma as its nearest sample has it; clamped to [0, 1]."""
    format_ = frame.format
    x, y = pixels.T
    black, span = format_.luma_code_range
    if format_.plane_count == 1:
        return np.repeat(((frame.planes[0][y, x] - black) / span)[:, None], 3, axis=1).clip(0.0, 1.0)
    shift_x, shift_y = (0, 0) if format_.matrix == "rgb" else format_.chroma_shift
    zero, chroma_span = (black, span) if format_.matrix == "rgb" else format_.chroma_code_range
    triple = np.empty((len(pixels), 3))
    triple[:, 0] = (frame.planes[0][y, x] - black) / span
    for k in (1, 2):
        triple[:, k] = (frame.planes[k][y >> shift_y, x >> shift_x] - zero) / chroma_span
    return np.clip(triple @ format_.rgb_from_ycc().T.astype(float), 0.0, 1.0)


def read_linear(frame: Frame, camera: Camera, samples: PaperSamples) -> Array:
    """Light (n, 3) of samples: decoded by the camera's own curve where it has one, freed of vignetting."""
    return decoded(samples.encoded, frame, camera) / camera.gain(samples.pixels)[:, None]


def decoded(encoded: Array, frame: Frame, camera: Camera) -> Array:
    """Light of encoded values, any shape, by the camera's own curve where it has one, else by the footage's."""
    if camera.radiometry is not None:
        return camera.radiometry.linear(encoded)
    table = decoding_table(frame.format.transfer)[:-1].astype(float)
    return np.interp(encoded, np.linspace(0.0, 1.0, len(table)), table)


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
