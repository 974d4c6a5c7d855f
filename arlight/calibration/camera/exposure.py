"""How bright a picture shows the frame's white paper: what automatic exposure and white balance change together.

Exposure and the light's own brightness are one product in a picture. What can be said is how the level of each channel
goes from frame to frame; a filter that is told so need not take a change of exposure for a change of light.
"""

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.camera.paper_samples import PaperSampler
from arlight.camera import Camera, Pose
from arlight.native import Workspace, address, library
from arlight.probe.design import Probe
from arlight.tracking.decoding import decoding
from arlight.video.frame import Frame
from arlight.video.layout import POINTERS, Layout, PictureCodes, layout_of
from arlight.video.pixel_format import PixelFormat

Array = NDArray[np.float64]

_LIBRARY = library(__file__, "exposure", keeps_lock=True)
_LIBRARY.measure.argtypes = [
    ctypes.c_void_p, POINTERS[Layout], POINTERS[PictureCodes], *([ctypes.c_int] * 2), *([ctypes.c_void_p] * 2),
]  # fmt: skip
_LIBRARY.measure.restype = None
_SPACING_MM = 2.2
_MOST_POINTS = 256
"""Pixels that are read: parts of the frame err together, so that more of each say nothing more."""


@dataclass(frozen=True, slots=True)
class PaperLevel:
    """White paper in one picture."""

    level: Array
    """(3,) light of the frame's white paper, mean over the frame; nan where it cannot be told."""
    variance: Array
    """(3,) of the level; infinite where it cannot be told."""
    share: float
    """Share of the frame's blank paper that was seen, unclipped and like the rest."""

    @property
    def valid(self) -> bool:
        """Whether all channels have a level."""
        return bool(np.all(np.isfinite(self.level)))

    def is_known_within(self, deviation: float) -> bool:
        """Whether the standard deviation of all channels is less than a share of their level."""
        numbers = zip(self.level.tolist(), self.variance.tolist(), strict=True)
        return all(variance < (deviation * level) ** 2 for level, variance in numbers)


_SCRATCH = ("gain", "values", "used_x", "used_y", "used_ink", "used_light")


class _Shared(Workspace):
    """What exposure.c calls Meter."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("points", "ink", "wedge", "sector", "scale", "mean", "vignetting")),
        *((name, ctypes.c_void_p) for name in ("light", "encoded", *_SCRATCH)),
        *((name, ctypes.c_void_p) for name in ("used_sector", "residual", "weight", "bits")),
        ("steps", ctypes.c_int64),
        ("clip", ctypes.c_double),
        ("code", ctypes.c_double),
    )


class ExposureMeter:
    """Measures the level of the frame's white paper in frames of one camera.

    Args:
        probe: the sheet.
        camera: intrinsics; its vignetting and radiometry are applied where it has them.

    Raises:
        ProbeError: the sheet's frame has no unprinted paper to speak of.
    """

    def __init__(self, probe: Probe, camera: Camera) -> None:
        self._camera = camera
        self._sampler = PaperSampler(probe, camera, _SPACING_MM, _MOST_POINTS)
        self._paper_share = len(self._sampler.paper_mm) / len(self._sampler.points_mm)
        self._format: PixelFormat | None = None
        self._size = (0, 0)
        self._shared = _shared(self._sampler, np.array(probe.sheet_mm) / 2.0, camera)
        self._at = ctypes.byref(self._shared)
        # rotation and translation of the pose; levels, variances, samples that had a say, points that were looked at
        self._pose, self._results = np.zeros((4, 3)), np.zeros((4, 3))
        self._pose_at, self._results_at = (address(array, np.float64) for array in (self._pose, self._results))

    def measure(self, frame: Frame, pose: Pose) -> PaperLevel:
        """Level of the white paper, with its variance.

        1. Pixels of blank paper, clear of all print, and of the wedge, divided by its reflectance.
        2. A smooth surface through them, robustly: a hand's shadow over a part of the frame has no say.
        3. Its mean over the whole frame. The variance counts parts of the frame, not pixels, as independent.

        The wedge serves only where most of the paper is clipped.

        Args:
            frame: the picture; its size is the camera's.
            pose: camera_from_probe.
        """
        if frame.format is not self._format or frame.size != self._size:
            self._decode(frame)
        self._pose[:3], self._pose[3] = pose.rotation, pose.translation
        _LIBRARY.measure(self._at, self._layout, frame.places, *self._size, self._pose_at, self._results_at)
        smallest = min(self._results[2].tolist()) / (self._results[3, 0] * self._paper_share)
        return PaperLevel(self._results[0].copy(), self._results[1].copy(), min(float(smallest), 1.0))

    def _decode(self, frame: Frame) -> None:
        """Take over what the codes of pictures like this stand for."""
        curve = decoding(frame.format.transfer, self._camera.radiometry)
        self._shared.hold({"light": np.ascontiguousarray(curve.light, np.float32)})
        self._shared.steps, self._shared.clip = len(curve.light) - 1, curve.clip
        self._shared.code = 1.0 / frame.format.luma_code_range[1]
        self._format, self._size = frame.format, frame.size
        self._layout = layout_of(frame.size, frame.format)


def _shared(sampler: PaperSampler, scale_mm: Array, camera: Camera) -> _Shared:
    """What the compiled part reads, but for the codes' meaning, and its scratch memory."""
    half_diagonal_px = 0.5 * np.hypot(*camera.image_size)
    vignetting = [*camera.camera_matrix[:2, 2], half_diagonal_px**-2, *(camera.vignetting or (0.0, 0.0, 0.0))]
    shared = _Shared(points=ctypes.addressof(sampler.shared))
    shared.hold(
        {
            "ink": sampler.reflectance.astype(np.float32),
            "wedge": (sampler.patch >= 0).astype(np.uint8),
            "sector": sampler.sector.astype(np.uint8),
            "scale": 1.0 / scale_mm,
            # the level is the mean over all of the paper, so that it does not depend on which of it is seen
            "mean": _surface(sampler.paper_mm / scale_mm).mean(axis=0),
            "vignetting": np.array(vignetting),
            "encoded": np.zeros(3 * _MOST_POINTS, np.float32),
            **{name: np.zeros(_MOST_POINTS) for name in (*_SCRATCH, "residual", "weight")},
            **{name: np.zeros(_MOST_POINTS, np.int32) for name in ("used_sector", "bits")},
        }
    )
    return shared


def _surface(position: Array) -> Array:
    """(n, 6) terms of a quadratic surface at positions (n, 2) within [-1, 1]."""
    x, y = position.T
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
