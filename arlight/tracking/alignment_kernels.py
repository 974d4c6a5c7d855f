"""The compiled alignment (alignment.c) and the memory that it shares with Python."""

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.native import Workspace, address, library
from arlight.probe.design import Probe
from arlight.tracking.lens import camera_parameters
from arlight.tracking.template import FiducialTemplate

Array = NDArray[np.float64]
Codes = NDArray[np.uint8] | NDArray[np.uint16]

LIGHTING, FEATURES = 4, 12
"""Features of a point: a marker's lighting, pose derivatives (rotation, translation), blur, and light in the last."""
LIGHT = FEATURES - 1
_FARTHEST_BYTES = 2**31
"""Places in a plane are counted in 32 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A frame's luma as the alignment reads it."""

    luma: Codes
    """(h, w) luma codes."""
    table: NDArray[np.float32]
    """(2^bits,) linear light of a code."""

    def eight_bits(self) -> NDArray[np.uint8]:
        """The codes of 8 bits, as OpenCV wants them."""
        if self.luma.dtype == np.uint8:
            return self.luma.view(np.uint8)
        surplus = max(len(self.table).bit_length() - 9, 0)
        return (self.luma >> surplus).astype(np.uint8)


class _Shared(Workspace):
    """`Alignment` of alignment.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("markers", "points", "size", "positions")),
        *((name, ctypes.c_void_p) for name in ("camera", "outline")),
        ("radius_mm", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("places", "black", "base", "spread", "index_u", "index_v", "drawn")),
        *((name, ctypes.c_void_p) for name in ("at", "slope", "features", "scratch", "shrunk", "coefficients")),
        *((name, ctypes.c_void_p) for name in ("gram", "correlation", "weight", "pose", "result", "codes", "table")),
        *((name, ctypes.c_int64) for name in ("stride", "code_bytes", "width", "height", "entries")),
    )


class AlignmentKernels:
    """Compiled alignment of one sheet's markers, with its memory.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera, lens distortion included.

    Raises:
        ProbeError: the sheet has no fiducials that ArUco knows.
        InstallationError: the compiled part is missing.
    """

    def __init__(self, probe: Probe, camera: Camera) -> None:
        template = FiducialTemplate.of_probe(probe)
        m, p = template.index_u.shape
        self.places = template.places.copy()
        """(m, 6) top left corner, one module to the right, one module down, x and y each, probe frame [mm]."""
        self.at, self.slope = np.zeros((m, 2, p), np.float32), np.zeros((m, 2, p), np.float32)
        """(m, 2, p) u and v of the points, and the template's derivatives there [modules]."""
        self.features = np.zeros((m, FEATURES, p), np.float32)
        """(m, 12, p) of the points, as alignment.h lists them."""
        self.coefficients, self.gram = np.zeros((m, LIGHTING)), np.zeros((m, FEATURES, FEATURES))
        """(m, 4) each marker's gain, its slopes and bias, (m, 12, 12) products of features, the lighting eliminated,
        upper triangle."""
        self.correlation, self.weight = np.zeros(m), np.zeros(m)
        """(m,) of each marker with its picture, and in the pose's equations: 0 is left out."""
        self.pose, self.result = np.zeros(12), np.zeros(3)
        """(12,) rotation row by row and translation, and (3,) residual rms, corners' standard deviation, blur [px]."""
        self._drawn = np.zeros((m, 4))
        corners = np.array([marker.corners_mm for marker in probe.markers], float)
        self._shared = _Shared(
            m, p, template.size, len(template.position_base), radius_mm=float(np.linalg.norm(corners, axis=2).max())
        )
        width, height = camera.image_size
        self._size = (height, width)
        self._table = np.empty(0, np.float32)
        self._shared.hold({**_constants(template, probe, camera), **self._memory(template)})
        self._at = ctypes.byref(self._shared)
        self._align, self._draw, self._observe = _functions()

    def _memory(self, template: FiducialTemplate) -> dict[str, NDArray[np.generic]]:
        """What the compiled code writes, by its name in the structure."""
        k, n, p = len(template.position_base), template.size, template.index_u.shape[1]
        height, width = self._size
        return {
            "places": self.places,
            "drawn": self._drawn,
            "at": self.at,
            "slope": self.slope,
            "features": self.features,
            "scratch": np.empty(max(3 * p, 2 * k + 7 * (n + 1) * k + k**2), np.float32),
            "shrunk": np.empty((height // 2 + 1, width // 2 + 1), np.float32),
            "coefficients": self.coefficients,
            "gram": self.gram,
            "correlation": self.correlation,
            "weight": self.weight,
            "pose": self.pose,
            "result": self.result,
        }

    def reset(self) -> None:
        """Draw the templates anew: without it, one drawn for nearly the same blur is kept."""
        self._drawn[:] = 0.0

    def show(self, picture: Picture) -> None:
        """Look at a picture from now on; it must outlive the calls.

        Raises:
            ValueError: not of the camera's size, or the table does not fit the codes.
        """
        shared = self._shared
        luma: NDArray[np.generic] = picture.luma
        if luma.shape != self._size or luma.dtype not in (np.uint8, np.uint16):
            raise ValueError(f"luma must be uint8 or uint16 {self._size}, found {luma.dtype} {luma.shape}")
        across, along = luma.strides
        if along != luma.itemsize or not 0 < across * luma.shape[0] < _FARTHEST_BYTES:
            luma = np.ascontiguousarray(luma)
        if picture.table is not self._table or len(self._table) < 256 * luma.itemsize:
            self._decode_by(picture.table, 256 * luma.itemsize)
        self._picture = luma
        shared.codes = luma.ctypes.data
        shared.stride, shared.code_bytes = luma.strides[0], luma.itemsize
        shared.height, shared.width = luma.shape

    def _decode_by(self, table: NDArray[np.float32], codes: int) -> None:
        if table.dtype != np.float32 or not table.flags.c_contiguous or len(table) < codes:
            raise ValueError(f"table must be float32, contiguous, an entry a code; found {table.dtype} {table.shape}")
        self._table = table
        self._shared.table, self._shared.entries = table.ctypes.data, len(table)

    def align(self, start: Pose, blur_px: float, coarsest: int) -> bool:
        """Align to the picture shown; pose, result and what the markers say are left in the arrays.

        Args:
            start: first guess.
            blur_px: standard deviation of the whole blur in the picture [px].
            coarsest: the first level shrinks the picture by this power of two.

        Returns:
            Whether there is a result.
        """
        self._place(start)
        return bool(self._align(self._at, blur_px, coarsest))

    @property
    def aligned(self) -> Pose:
        """camera_from_probe that `align` found."""
        return _pose_of(self.pose.copy())

    def draw(self, pose: Pose, blur_px: float) -> None:
        """Draw the templates as they look at a pose, blurred by a standard deviation [px]."""
        self._place(pose)
        self._draw(self._at, blur_px)

    def observe(self, pose: Pose, floor: float) -> int:
        """The markers' own equations at a pose, as drawn; how many correlate better than `floor` and take part."""
        self._place(pose)
        return int(self._observe(self._at, floor))

    def _place(self, pose: Pose) -> None:
        self.pose[:9] = pose.rotation.ravel()
        self.pose[9:] = pose.translation


_brief = library(__file__, "alignment", keeps_lock=True)
_brief.extrapolate.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p]
_brief.extrapolate.restype = None


def extrapolate(before: Pose, last: Pose, share: float) -> Pose:
    """The pose after a share of the motion from one pose to another, counted from the latter; half a turn is none."""
    poses = np.empty((3, 12))
    for row, pose in zip(poses, (before, last), strict=False):
        row[:9], row[9:] = pose.rotation.ravel(), pose.translation
    at = address(poses, np.float64)
    _brief.extrapolate(at, at + poses.strides[0], share, at + 2 * poses.strides[0])
    return _pose_of(poses[2])


def _pose_of(numbers: Array) -> Pose:
    """Of (12,) rotation row by row and translation."""
    return Pose(numbers[:9].reshape(3, 3), numbers[9:])


def _constants(template: FiducialTemplate, probe: Probe, camera: Camera) -> dict[str, NDArray[np.generic]]:
    """What the compiled code reads, by its name in the structure."""
    return {
        "camera": camera_parameters(camera),
        "outline": np.ascontiguousarray(probe.outline_mm, float),
        "black": template.black.astype(np.float32),
        "base": template.position_base.astype(np.float32),
        "spread": template.position_spread.astype(np.float32),
        "index_u": template.index_u.astype(np.int32),
        "index_v": template.index_v.astype(np.int32),
    }


def _functions() -> tuple["ctypes._NamedFuncPointer", "ctypes._NamedFuncPointer", "ctypes._NamedFuncPointer"]:
    compiled = library(__file__, "alignment")
    for function, kinds in (
        (compiled.align, [ctypes.c_double, ctypes.c_int]),
        (compiled.draw, [ctypes.c_double]),
        (compiled.observe_markers, [ctypes.c_double]),
    ):
        function.argtypes = [ctypes.POINTER(_Shared), *kinds]
    compiled.draw.restype = None
    return compiled.align, compiled.draw, compiled.observe_markers
