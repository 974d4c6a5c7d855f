"""Views of the sheet from frames: tracked, chosen for their variety, and measured."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layers.sheet_view import SheetView
from arlight.camera import Camera
from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.nuisance import Nuisance
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.blocks import BlockMeter
from arlight.tracking.luma import luma_plane
from arlight.tracking.pose import ProbePose
from arlight.tracking.tracker import PoseTracker
from arlight.video.frame import Frame

Array = NDArray[np.float64]

_REPEATS = 2
"""How often a view is measured again with the stripes to expect, as the last measurement shows them."""


@dataclass(frozen=True, slots=True)
class SeenSheet:
    """A frame that shows the sheet, and where."""

    frame: Frame
    """The picture."""
    pose: ProbePose
    """Where the sheet is in it; tracked."""
    light: int = 0
    """Which of several lights shone."""

    @property
    def offset_mm(self) -> Array:
        """(3,) where the camera stands above the sheet's centre [mm]."""
        assert self.pose.camera_from_probe is not None
        return self.pose.camera_from_probe.camera_centre_mm


def find_sheet(frames: Iterable[Frame], probe: Probe, camera: Camera, light: int = 0) -> list[SeenSheet]:
    """The frames, in order, in which the sheet is tracked."""
    tracker = PoseTracker(probe, camera)
    seen = []
    for frame in frames:
        codes, table = luma_plane(frame, camera.radiometry)
        pose = tracker.update(codes, frame.time_s, table)
        if pose.camera_from_probe is not None and pose.status == "tracked":
            seen.append(SeenSheet(frame, pose, light))
    return seen


def light_plane_points(seen: Sequence[SeenSheet], probe: Probe) -> Array:
    """(n, 2) where each view lies on the light plane, from the sheet's centre."""
    toward = np.array([view.offset_mm for view in seen]).reshape(-1, 3)
    toward /= np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), 1e-9)
    return probe.slab.light_plane(toward)


def varied(seen: Sequence[SeenSheet], probe: Probe, count: int) -> list[SeenSheet]:
    """At most `count` of the views, as different in direction as they come: the farthest from the chosen is next."""
    if len(seen) <= count:
        return list(seen)
    points = light_plane_points(seen, probe)
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(int(np.argmax(distance)))
        away = np.linalg.norm(points - points[chosen[-1]], axis=1)
        distance = np.minimum(distance, away) if len(chosen) > 1 else away
        distance[chosen] = -1.0
    return [seen[i] for i in sorted(chosen)]


class ViewMeter:
    """Measures views as an assembled sheet is believed to be."""

    def __init__(self, probe: Probe, camera: Camera, assembly: Assembly) -> None:
        self._probe, self._camera, self._assembly = probe, camera, assembly
        self._meter = BlockMeter(probe, camera, assembly=assembly)
        self._estimator = LightingEstimator(probe, assembly)

    def measure(self, seen: SeenSheet) -> SheetView:
        """Measure one view by itself."""
        pose, time_s = seen.pose.camera_from_probe, seen.frame.time_s
        assert pose is not None
        nuisance = Nuisance.guess(seen.pose.blur_px**2)
        means = self._meter.measure(seen.frame, pose, seen.pose.blur_px)
        for _ in range(_REPEATS):
            estimate = self._estimator.estimate(means, time_s, nuisance)
            nuisance = estimate.nuisance
            means = self._meter.measure(seen.frame, pose, seen.pose.blur_px, estimate.stripes)
        blur_px = float(np.sqrt(nuisance.blur_variance_px2))
        return SheetView.of(means, self._assembly, self._probe, self._camera, pose, blur_px, seen.light)
