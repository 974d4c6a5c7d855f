"""Frames in, pose and lighting out: the estimation half of the frame loop, without rendering."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from arlight.calibration.camera.exposure import ExposureMeter
from arlight.camera import Camera
from arlight.errors import ProbeError
from arlight.estimation.estimator import Estimate, LightingEstimator
from arlight.estimation.filter import LightingFilter
from arlight.estimation.lighting import Lighting
from arlight.estimation.nuisance import Nuisance
from arlight.fourier import orders_up_to
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter
from arlight.tracking.luma import luma_plane
from arlight.tracking.pose import ProbePose
from arlight.tracking.tracker import PoseTracker
from arlight.video.frame import Frame

_DEFAULT_BLUR_PX = 0.6
_LEVEL_DEVIATION = 0.005
"""Relative deviation beyond which the white paper's level is worse than the light's own from frame to frame."""
_FIRST_PASSES = 3
"""How often the first frame is measured until its colour lines have settled."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """Choices that trade speed for accuracy."""

    samples_per_block: int = 1200
    """Pixels a block is sampled with at most."""
    alignment_levels: int = 1
    """Levels of resolution that the pose is aligned on, 1 to 4; coarser ones are always there to fall back on."""
    filtered: bool = True
    """Average over time; without it every frame stands alone."""
    bounces: bool = True
    """Model the light reflected between paper and glass; off only for sheets without it."""
    order: int | None = None
    """Highest order of the lighting that is told; the sheet's by default. What lies beyond is still fitted, so that it
    does not pass for light of a lower order."""


@dataclass(frozen=True, slots=True)
class FrameEstimate:
    """What one frame told."""

    index: int
    """Number of the frame in its source."""
    time_s: float
    """Its time [s]."""
    pose: ProbePose
    """Where the sheet is; `coasting` when it is hidden and the lighting is carried on."""
    lighting: Lighting | None
    """Filtered lighting; None before the first estimate."""
    raw: Lighting | None
    """This frame's own estimate; None when the sheet was not seen."""
    timings_s: dict[str, float] = field(default_factory=dict)
    """Time of each stage by the tracker's clock, wall time by default [s]."""
    unexplained: float = float("nan")
    """Share of the stripes in this frame that the probe does not explain under any light, 0 to about 1; nan where no
    stripes are resolved."""


class BlockEstimator(Protocol):
    """What makes lighting of a frame's blocks, such as `LightingEstimator`."""

    def estimate(self, means: BlockMeans, time_s: float, nuisance: Nuisance | None = None) -> Estimate:
        """Lighting of one frame from its blocks and the last frame's nuisance."""


class LightingTracker:
    """Follows the sheet and the light that falls on it.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera that filmed it.
        settings: choices that trade speed for accuracy.
        assembly: what calibration found the printed sheet to be; exactly as designed by default.
        estimator: what makes lighting of the blocks; the model of the assembled sheet by default.
        clock: what times the stages [s].

    Raises:
        ProbeError: the sheet's fiducials are unknown to ArUco, or it does not measure the order that is asked for.
    """

    def __init__(
        self,
        probe: Probe,
        camera: Camera,
        settings: TrackerSettings | None = None,
        assembly: Assembly | None = None,
        estimator: BlockEstimator | None = None,
        clock: Callable[[], float] = perf_counter,
    ) -> None:
        self._settings = settings or TrackerSettings()
        self._clock = clock
        if self._settings.order is not None:
            orders_up_to(probe.frequencies, self._settings.order)
        self._radiometry = camera.radiometry
        self._tracker = PoseTracker(probe, camera, self._settings.alignment_levels)
        self._meter = BlockMeter(probe, camera, self._settings.samples_per_block, assembly)
        self._estimator = estimator or LightingEstimator(probe, assembly, bounces=self._settings.bounces)
        self._filter = LightingFilter()
        self._exposure = _exposure_meter(probe, camera)
        self.reset()

    def reset(self) -> None:
        """Forget everything about earlier frames."""
        self._tracker.reset()
        self._filter.reset()
        self._last: Estimate | None = None
        self._level = np.ones(3)

    def update(self, frame: Frame) -> FrameEstimate:
        """Pose and lighting of the next frame.

        Raises:
            CameraError: the frame's size is not the camera's.
        """
        # products this small run slower on several threads than on one
        with threadpool_limits(limits=1, user_api="blas"):
            return self._update(frame)

    def _update(self, frame: Frame) -> FrameEstimate:
        start = self._clock()
        codes, table = luma_plane(frame, self._radiometry)
        pose = self._tracker.update(codes, frame.time_s, table)
        tracked = self._clock()
        estimate, measured = self._estimate(frame, pose)
        raw = None if estimate is None else self._cut(estimate.lighting)
        estimated = self._clock()
        lighting = self._filtered(raw, frame, pose) if self._settings.filtered else raw
        timings = {
            "track": tracked - start,
            "measure": measured - tracked,
            "estimate": estimated - measured,
            "filter": self._clock() - estimated,
        }
        if pose.camera_from_probe is None and lighting is not None:
            pose = ProbePose(None, float("nan"), "coasting")
        unexplained = float("nan") if estimate is None else estimate.unexplained
        return FrameEstimate(frame.index, frame.time_s, pose, lighting, raw, timings, unexplained)

    def _estimate(self, frame: Frame, pose: ProbePose) -> tuple[Estimate | None, float]:
        """The frame's own estimate, and when its blocks had been measured."""
        if pose.camera_from_probe is None:
            return None, self._clock()
        blur_px = pose.blur_px if np.isfinite(pose.blur_px) else _DEFAULT_BLUR_PX
        last, measured = self._last, 0.0
        for _ in range(1 if last else _FIRST_PASSES):
            stripes, nuisance = (last.stripes, last.nuisance) if last else (None, Nuisance(blur_px**2))
            means = self._meter.measure(frame, pose.camera_from_probe, blur_px, stripes)
            measured = self._clock()
            last = self._estimator.estimate(means, frame.time_s, nuisance)
        self._last = last
        return last, measured

    def _filtered(self, raw: Lighting | None, frame: Frame, pose: ProbePose) -> Lighting | None:
        """The light over time, relative to the frame's white paper: a change of exposure is no change of light."""
        if self._exposure is not None and pose.camera_from_probe is not None:
            seen = self._exposure.measure(frame, pose.camera_from_probe)
            if np.all(seen.variance < (_LEVEL_DEVIATION * seen.level) ** 2):
                self._level = seen.level
        return self._filter.update(raw, frame.time_s, self._level)

    def _cut(self, lighting: Lighting) -> Lighting:
        order = self._settings.order
        return lighting if order is None else lighting.truncated(order)


def _exposure_meter(probe: Probe, camera: Camera) -> ExposureMeter | None:
    """None for sheets whose frame shows too little blank paper."""
    try:
        return ExposureMeter(probe, camera)
    except ProbeError:
        return None
