"""Frames in, pose and lighting out: the estimation half of the frame loop, without rendering."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from arlight.calibration.camera.exposure import ExposureMeter
from arlight.camera import Camera
from arlight.effort import Effort
from arlight.errors import ProbeError
from arlight.estimation.estimator import Estimate, LightingEstimator
from arlight.estimation.filter import LightingFilter
from arlight.estimation.lighting import Lighting
from arlight.estimation.natural_light import NaturalLight
from arlight.estimation.nuisance import Nuisance
from arlight.estimation.order_choice import OrderChoice
from arlight.estimation.shown_light import Need
from arlight.fourier import frequency_order, orders_up_to
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracker_settings import TrackerSettings
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter
from arlight.tracking.luma import luma_plane
from arlight.tracking.pose import ProbePose
from arlight.tracking.tracker import PoseTracker
from arlight.video.frame import Frame

_DEFAULT_BLUR_PX = 0.6
_LEVEL_DEVIATION = 0.005
"""Relative deviation beyond which the white paper's level is worse than the light's own from frame to frame."""
_ALONE = 64
"""Rows of square matrices up to which OpenBLAS multiplies them on one thread by itself."""
_LEAST_ORDER = 1
"""Order up to which blocks are measured at least, where the sheet has it: lamps in the few blocks without stripes leave
nothing that tells L_0."""
_LOWER_EVERY = 4
"""Frames from one in which light is measured to the next, at least, where a lower order than the sheet's was found to
suffice: that tells the filter as well what it averages, and a change is still seen soon."""
_FIRST_PASSES = 3
"""How often the first frame is measured until its colour lines have settled."""


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
    effort: Effort = field(default_factory=Effort)
    """Limits that the work on it was held to."""
    timings_s: dict[str, float] = field(default_factory=dict)
    """Time of each stage by the tracker's clock, wall time by default [s]."""
    unexplained: float = float("nan")
    """Share of the stripes in this frame that the probe does not explain under any light, 0 to about 1; nan where no
    stripes are resolved."""


class BlockEstimator(Protocol):
    """What makes lighting of a frame's blocks, such as `LightingEstimator`."""

    def estimate(
        self, means: BlockMeans, time_s: float, nuisance: Nuisance | None = None, order: int | None = None
    ) -> Estimate:
        """Lighting of one frame up to an order from its blocks and the last frame's nuisance."""


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
        self.settings = settings or TrackerSettings()
        """As they were given."""
        self.effort = Effort()
        """Limits to the work on the frames to come; may change from frame to frame."""
        self._clock = clock
        if isinstance(self.settings.order, int):
            orders_up_to(probe.frequencies, self.settings.order)
        self._radiometry = camera.radiometry
        self._tracker = PoseTracker(probe, camera, self.settings.alignment_levels)
        self._meter = BlockMeter(probe, camera, self.settings.samples_per_block, assembly)
        self._estimator = estimator or LightingEstimator(
            probe, assembly, bounces=self.settings.bounces, iterations=self.settings.iterations
        )
        self._filter = LightingFilter()
        self._exposure = _exposure_meter(probe, camera)
        self._probe, self._highest = probe, probe.order
        self._block_order = _block_orders(probe)
        self._blas: ThreadpoolController | None = None
        if assembly is not None or estimator is not None:
            self._multiply_on_one_thread()
        self._choice: OrderChoice | None = None
        self.reset()

    def require(self, need: Need) -> None:
        """Say what the light is wanted for, which the order `auto` goes by; until then all orders are measured."""
        if self.settings.order == "auto":
            self._multiply_on_one_thread()
            self._choice = OrderChoice(NaturalLight(self._probe.slab, self._probe.frequencies), need)

    def reset(self) -> None:
        """Forget everything about earlier frames."""
        self._tracker.reset()
        self._filter.reset()
        if self._choice is not None:
            self._choice.reset()
        self._last: Estimate | None = None
        self._level = np.ones(3)
        self._since_estimate = 0

    def update(self, frame: Frame) -> FrameEstimate:
        """Pose and lighting of the next frame.

        Raises:
            CameraError: the frame's size is not the camera's.
        """
        with self._one_thread():
            return self._update(frame)

    def _multiply_on_one_thread(self) -> None:
        """From now on frames need products of matrices; without them, nobody need be asked about threads."""
        if 2 * len(self._probe.frequencies) > _ALONE:
            self._blas = ThreadpoolController().select(user_api="blas")

    def _one_thread(self) -> AbstractContextManager[object]:
        """Products this small run slower on several threads than on one; asking costs less than setting."""
        if self._blas is None or all(blas.num_threads == 1 for blas in self._blas.lib_controllers):
            return nullcontext()
        return self._blas.limit(limits=1)

    def _update(self, frame: Frame) -> FrameEstimate:
        start = self._clock()
        codes, table = luma_plane(frame, self._radiometry)
        pose = self._tracker.update(codes, frame.time_s, table)
        tracked = self._clock()
        estimate, measured = self._estimate(frame, pose) if self._is_due(pose) else (None, tracked)
        raw = None if estimate is None else estimate.lighting
        estimated = self._clock()
        lighting = self._filtered(raw, frame, pose) if self.settings.filtered else raw
        if self._choice is not None and lighting is not None:
            if raw is not None:
                self._choice.learn(raw, lighting, frame.time_s)
            lighting = self._choice.shown(lighting)
        timings = {
            "track": tracked - start,
            "measure": measured - tracked,
            "estimate": estimated - measured,
            "filter": self._clock() - estimated,
        }
        if pose.camera_from_probe is None and lighting is not None:
            pose = ProbePose(None, float("nan"), "coasting")
        unexplained = float("nan") if estimate is None else estimate.unexplained
        return FrameEstimate(frame.index, frame.time_s, pose, lighting, raw, self.effort, timings, unexplained)

    def _is_due(self, pose: ProbePose) -> bool:
        """Whether the light is measured in this frame."""
        if pose.camera_from_probe is None:
            return False
        self._since_estimate += 1
        every = max(self.effort.estimate_every or 1, self.settings.estimate_every)
        if self.settings.filtered and self._choice is not None and self._choice.order < self._highest:
            every = max(every, _LOWER_EVERY)
        if self._last is not None and self._since_estimate < every:
            return False
        self._since_estimate = 0
        return True

    def _estimate(self, frame: Frame, pose: ProbePose) -> tuple[Estimate, float]:
        """The frame's own estimate, and when its blocks had been measured."""
        assert pose.camera_from_probe is not None
        blur_px = pose.blur_px if np.isfinite(pose.blur_px) else _DEFAULT_BLUR_PX
        wanted = self._order_to_measure(frame.time_s)
        order = max(wanted, min(_LEAST_ORDER, self._highest))
        blocks = self._block_order <= order if order < self._highest else None
        last = self._last
        for _ in range(1 if last else _FIRST_PASSES):
            stripes, nuisance = (last.stripes, last.nuisance) if last else (None, Nuisance.guess(blur_px**2))
            means = self._meter.measure(
                frame, pose.camera_from_probe, blur_px, stripes, blocks, self.effort.samples_per_block
            )
            measured = self._clock()
            estimate = self._estimator.estimate(means, frame.time_s, nuisance, order)
            if last is not None:
                estimate = estimate.guiding_on(blocks, last.stripes)
            last = estimate
        assert last is not None
        self._last = last
        return last if wanted == order else replace(last, lighting=last.lighting.truncated(wanted)), measured

    def _order_to_measure(self, time_s: float) -> int:
        order = self.settings.order if isinstance(self.settings.order, int) else self._highest
        if self._choice is not None:
            order = self._choice.order_to_measure(time_s)
        return order if self.effort.order is None else min(order, self.effort.order)

    def _filtered(self, raw: Lighting | None, frame: Frame, pose: ProbePose) -> Lighting | None:
        """The light over time, relative to the frame's white paper: a change of exposure is no change of light."""
        seen = pose.camera_from_probe is not None
        if self._exposure is not None and raw is not None and pose.camera_from_probe is not None:
            paper = self._exposure.measure(frame, pose.camera_from_probe)
            if paper.is_known_within(_LEVEL_DEVIATION):
                self._level = paper.level
        if self._choice is not None and raw is not None and raw.order > self._choice.order:
            raw = raw.truncated(self._choice.order)
        return self._filter.update(raw, frame.time_s, self._level, hidden=not seen)


def _block_orders(probe: Probe) -> NDArray[np.int64]:
    """(blocks,) order of each block's frequency, 0 where there are no stripes."""
    return frequency_order([block.frequency or (0, 0) for block in field_blocks(probe)])


def _exposure_meter(probe: Probe, camera: Camera) -> ExposureMeter | None:
    """None for sheets whose frame shows too little blank paper."""
    try:
        return ExposureMeter(probe, camera)
    except ProbeError:
        return None
