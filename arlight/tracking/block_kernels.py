"""The compiled measuring of blocks (blocks.c) and the memory that it shares with Python."""

import ctypes
from functools import cache

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import CameraError
from arlight.native import Workspace, library
from arlight.tracking.block_layout import WANTED, BlockLayout
from arlight.tracking.block_means import HARMONICS, ROWS, BlockMeans
from arlight.tracking.decoding import Decoding
from arlight.tracking.lens import camera_parameters
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat

Array = NDArray[np.float64]

_LANES, _STEP = 16, 8
"""Blocks and pixels that are worked on together."""
_LINE = 16
"""Floats of a cache line."""
_EDGES, _CUBIC, _TERMS, _HUES = 8, 4, 16, 3
LISTS = 3 + 8 * 7 + 16 + 3
"""Lists of pixels: of codes, of eight blocks at a time, and of a curved fit's columns and what is read with them."""
TINT = 1 + ROWS + 3
SUMS = 2 * (2 * HARMONICS + 1) + 4 * (HARMONICS + 1) + 3 + 3 * (ROWS + 2) + 3
"""Floats of `Tint` and `Sums` of blocks.h."""
_RESULTS = (("values", ROWS * 3), ("covariance", ROWS * ROWS), ("variance", 3), ("shading", 3), ("cycles", 2),
            ("phasor", 2), ("cosine", 1), ("trust", 1))  # fmt: skip
_ROUNDS = (*range(9), 12, 16, 24, 32, 40)
_STRAIGHT = 1e-6
"""How far rays of undistorted pixels may be off: a thousandth of a pixel."""


class Shared(Workspace):
    """`Blocks` of blocks.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("blocks", "width", "height")),
        *((name, ctypes.c_void_p) for name in ("lens", "upright")),
        ("rounds", ctypes.c_int64),
        ("vignetting", ctypes.c_double * 3),
        ("half_diagonal_px", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("sheet", "flags")),
        *((name, ctypes.c_double) for name in ("reach_mm", "glass_mm", "index")),
        ("pose", ctypes.c_void_p),
        ("edge_px", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("seen", "harmonics", "frequency", "margin", "gain", "box", "edges")),
        *((name, ctypes.c_void_p) for name in ("surfaces", "look")),
        *((name, ctypes.c_int64) for name in ("limit", "room")),
        *((name, ctypes.c_void_p) for name in ("order", "spans", "rows", "steps", "lists", "hue", "tints")),
        *((name, ctypes.c_void_p) for name in ("mean_code", "sums", "gathered")),
        ("planes", ctypes.c_void_p * 3),
        ("stride", ctypes.c_int64 * 3),
        *((name, ctypes.c_int64) for name in ("bytes", "shift_x", "shift_y")),
        ("offset", ctypes.c_double * 3),
        ("scale", ctypes.c_double * 3),
        ("rgb_from_ycc", ctypes.c_double * 9),
        ("ycc_from_rgb", ctypes.c_double * 9),
        ("displacement_px", ctypes.c_double * 2),
        *((name, ctypes.c_void_p) for name in ("light", "encoding")),
        ("entries", ctypes.c_int64),
        ("clip", ctypes.c_double),
        ("stripes", ctypes.c_void_p),
        *((name, ctypes.c_void_p) for name, _ in _RESULTS),
        *((name, ctypes.c_void_p) for name in ("resolved", "samples", "valid")),
    )


class BlockKernels:
    """Compiled measuring of one sheet's blocks with one camera, and its memory.

    Args:
        layout: the blocks.
        camera: that films them.
        samples: pixels a block at most, 16 or more.

    Raises:
        InstallationError: the compiled part is missing.
    """

    def __init__(self, layout: BlockLayout, camera: Camera, samples: int) -> None:
        self._count = count = len(layout.half_mm)
        self._most = samples
        self._layout, self._size = layout, camera.image_size
        n = -(-count // _LANES) * _LANES
        self.flags = np.zeros(n, np.uint8)
        self.pose = np.zeros(12)
        self.stripes = np.zeros((n, ROWS, 3))
        self.hue = np.zeros((n, _HUES, ROWS + 1), np.float32)
        self.mean_code = np.zeros((n, 3))
        self.gathered = np.zeros(n, np.int32)
        self._shared = shared = Shared(n, *camera.image_size)
        own: dict[str, NDArray[np.generic]] = {
            "flags": self.flags,
            "pose": self.pose,
            "hue": self.hue,
            "mean_code": self.mean_code,
        }
        shared.hold({**own, "gathered": self.gathered, "sheet": _sheet(layout, n), **_views(n)})
        shared.vignetting[:] = camera.vignetting or (0.0, 0.0, 0.0)
        shared.half_diagonal_px = 0.5 * float(np.hypot(*camera.image_size))
        shared.reach_mm, shared.glass_mm = layout.slab.max_offset_mm, layout.slab.glass_mm
        shared.index = layout.slab.refractive_index
        _prepare_lists(shared, samples)
        self._at = ctypes.byref(shared)
        self._format: PixelFormat | None = None
        self._curve: Decoding | None = None
        self._survey, self._measure, self._undistort = _functions()
        shared.rounds = self._prepare_lens(camera)

    def limit(self, samples: int | None) -> None:
        """Sample a block with fewer pixels than there is room for; None for all."""
        self._shared.limit = self._most if samples is None else min(samples, self._most)

    def place(self, pose: Pose, edge_px: float, blocks: NDArray[np.bool_] | None) -> None:
        """Say where the sheet is and which of its blocks are wanted."""
        self.pose[:9] = np.asarray(pose.rotation, float).ravel()
        self.pose[9:] = pose.translation
        self._shared.edge_px = edge_px
        layout = self._layout
        self.flags[: self._count] = layout.flags
        if blocks is not None:
            self.flags[: self._count][~np.asarray(blocks, bool)] &= ~np.uint8(WANTED)

    def show(self, frame: Frame, curve: Decoding) -> None:
        """Say what to measure on, and what its codes stand for.

        Raises:
            CameraError: the frame's size is not the camera's.
        """
        if frame.size != self._size:
            raise CameraError(
                f"the frame has {frame.size} pixels, the camera {self._size}; give the camera that filmed it"
            )
        shared = self._shared
        if frame.format is not self._format:
            self._format = frame.format
            _describe(shared, frame.format)
        if curve is not self._curve:
            self._curve = curve
            shared.hold({"light": curve.light, "encoding": curve.codes})
            shared.entries, shared.clip = len(curve.light), curve.clip
        # while its codes are read
        self._frame = frame
        for channel in range(3):
            plane = channel if channel < len(frame.planes) else 0
            shared.planes[channel] = frame.places.planes[plane]
            shared.stride[channel] = frame.places.strides[plane]

    def survey(self) -> tuple[Array, NDArray[np.int32]]:
        """Mean luma and chroma (blocks, 3) of every block, and of how many chroma samples each is."""
        results = self._results()
        self._survey(self._at)
        del results
        return self.mean_code[: self._count], self.gathered[: self._count]

    def measure(self, stripes: Array | None) -> BlockMeans:
        """All blocks' measurements."""
        if stripes is None:
            self._shared.stripes = None
        else:
            self.stripes[: self._count] = stripes
            self._shared.stripes = self.stripes.ctypes.data
        results, counts, valid = self._results()
        self._measure(self._at)
        n = self._count
        parts, at = {}, 0
        total = len(self.flags)
        for name, columns in _RESULTS:
            parts[name] = results[at : at + columns * n]
            at += columns * total
        return BlockMeans(
            values=parts["values"].reshape(n, ROWS, 3),
            covariance=parts["covariance"].reshape(n, ROWS, ROWS),
            pixel_variance=parts["variance"].reshape(n, 3),
            shading=parts["shading"].reshape(n, 3),
            harmonics=counts[0, :n],
            samples=counts[1, :n],
            valid=valid[:n],
            view_phasor=parts["phasor"].view(np.complex128),
            view_cosine=parts["cosine"],
            cycles_per_px=parts["cycles"].reshape(n, 2),
            color_trust=parts["trust"],
        )

    def rays(self, pixels: Array, rounds: int) -> Array:
        """Rays (n, 2) of pixels (n, 2), the distortion undone in so many rounds; n is a multiple of 16."""
        columns = np.ascontiguousarray(pixels.T, np.float32)
        rays = np.empty_like(columns)
        self._undistort(self._at, rounds, len(pixels), columns.ctypes.data, rays.ctypes.data)
        return rays.T.astype(float)

    def _prepare_lens(self, camera: Camera) -> int:
        """The fewest rounds that undo the distortion all over the picture."""
        parameters = camera_parameters(camera)
        self._shared.hold({"lens": parameters, "upright": np.linalg.inv(parameters[16:].reshape(3, 3)).ravel()})
        width, height = camera.image_size
        across, down = np.meshgrid(np.linspace(0.0, width - 1.0, 16), np.linspace(0.0, height - 1.0, 16))
        pixels = np.stack([across.ravel(), down.ravel()], axis=1)
        exact = camera.rays(pixels)
        for rounds in _ROUNDS:
            if np.abs(self.rays(pixels, rounds) - exact).max() < _STRAIGHT:
                return rounds
        return _ROUNDS[-1]

    def _results(self) -> tuple[Array, NDArray[np.int64], NDArray[np.bool_]]:
        """Fresh memory for what is measured."""
        n = len(self.flags)
        results = np.empty(n * sum(columns for _, columns in _RESULTS))
        counts, valid = np.zeros((2, n), np.int64), np.zeros(n, np.bool_)
        at = results.ctypes.data
        for name, columns in _RESULTS:
            setattr(self._shared, name, at)
            at += 8 * n * columns
        self._shared.resolved = counts.ctypes.data
        self._shared.samples = counts.ctypes.data + 8 * n
        self._shared.valid = valid.ctypes.data
        return results, counts, valid


def _aligned(shape: tuple[int, int]) -> NDArray[np.float32]:
    """Zeros that begin with a cache line: vectors across two of them are read at half the speed."""
    memory = np.zeros(shape[0] * shape[1] + _LINE, np.float32)
    start = -(memory.ctypes.data // memory.itemsize) % _LINE
    return memory[start : start + shape[0] * shape[1]].reshape(shape)


def _views(n: int) -> dict[str, NDArray[np.generic]]:
    """Memory for how n blocks appear."""
    return {
        "seen": np.zeros(n, np.int32),
        "harmonics": np.zeros(n, np.int32),
        "frequency": np.zeros((2, n), np.float32),
        "margin": np.zeros((2, n), np.float32),
        "gain": np.ones(n, np.float32),
        "box": np.zeros((4, n), np.float32),
        "edges": np.zeros((_EDGES, 3, n), np.float32),
        "surfaces": _aligned((n, _CUBIC * _TERMS)),
        "look": np.zeros((2, 5, n), np.float32),
        "order": np.zeros(n, np.int32),
        "tints": np.zeros((n, 3, TINT), np.float32),
        "sums": np.zeros((n, SUMS), np.float32),
    }


def _prepare_lists(shared: Shared, samples: int) -> None:
    """Memory for the pixels of the blocks that are fitted together, `samples` each at most."""
    height = shared.height
    room = (min(samples, shared.width * height) + 2 * _STEP + _LINE - 1) // _LINE * _LINE
    shared.limit, shared.room = samples, room
    shared.hold(
        {
            "spans": np.zeros((2, height), np.int32),
            "rows": _aligned((height, _TERMS)),
            "steps": np.zeros(room, np.int32),
            "lists": _aligned((LISTS, room)),
        }
    )


def _sheet(layout: BlockLayout, n: int) -> NDArray[np.float32]:
    cycles = np.sum(layout.cycles_per_mm * layout.centers_mm, axis=1) + layout.phase_rad / (2.0 * np.pi)
    rows = np.vstack([layout.centers_mm.T, layout.half_mm, layout.cycles_per_mm.T, cycles - np.round(cycles)])
    padding = np.repeat(rows[:, :1], n - rows.shape[1], axis=1)
    return np.ascontiguousarray(np.hstack([rows, padding]), np.float32)


def _describe(shared: Shared, format_: PixelFormat) -> None:
    stored = format_.matrix in ("rgb", "gray")
    black, white = format_.luma_code_range
    neutral, swing = (black, white) if stored else format_.chroma_code_range
    shared.offset[:] = (black, neutral, neutral)
    shared.scale[:] = (1.0 / white, 1.0 / swing, 1.0 / swing)
    shared.bytes = np.dtype(format_.dtype).itemsize
    shared.shift_x, shared.shift_y = format_.chroma_shift
    shared.rgb_from_ycc[:] = format_.rgb_from_ycc().astype(float).ravel().tolist()
    shared.ycc_from_rgb[:] = format_.ycc_from_rgb().astype(float).ravel().tolist()
    shared.displacement_px[:] = [
        offset - (2.0**shift - 1.0) / 2.0
        for offset, shift in zip(format_.chroma_offset_px, format_.chroma_shift, strict=True)
    ]


@cache
def _functions():
    compiled = library(__file__, "blocks")
    for function in (compiled.survey_blocks, compiled.measure_blocks, compiled.undistort_pixels):
        function.argtypes, function.restype = [ctypes.c_void_p], None
    compiled.undistort_pixels.argtypes = [
        ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p,
    ]  # fmt: skip
    return compiled.survey_blocks, compiled.measure_blocks, compiled.undistort_pixels
