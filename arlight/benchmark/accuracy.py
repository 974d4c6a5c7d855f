"""The accuracy table: error per order over camera tilts and sheet widths, beside the Cramer-Rao bound."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.evaluation import Evaluation, evaluate
from arlight.estimation.bound import CramerRaoBound, sensor_variance
from arlight.fourier import frequency_order
from arlight.lighting_tracker import LightingTracker
from arlight.probe.design import Probe
from arlight.results.log import LightingLog
from arlight.results.record import LogHeader, LogRecord
from arlight.synthetic.settings import SynthesisSettings
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.synthesis import SyntheticFrame, synthesize
from arlight.synthetic.truth import ClipTruth
from arlight.tracker_settings import TrackerSettings
from arlight.tracking.blocks import BlockMeter


@dataclass(frozen=True)
class AccuracySettings:
    """What the table is measured on."""

    tilts_deg: tuple[float, ...] = (15.0, 35.0, 55.0, 70.0)
    """Camera's angle off the sheet's normal [deg]."""
    widths_px: tuple[float, ...] = (300.0, 450.0, 700.0)
    """Width of the sheet in the picture [px]."""
    frames: int = 16
    """Frames of each clip, of which the first ten settle the filter."""
    footage: SynthesisSettings = field(default_factory=lambda: SynthesisSettings(path="still"))
    """Light, path, camera and sensor; tilt, width and length are replaced."""


@dataclass(frozen=True, slots=True)
class AccuracyCell:
    """One clip of the table."""

    tilt_deg: float
    """Camera's angle off the normal [deg]."""
    width_px: float
    """Width of the sheet that was asked for [px]; the sheet is smaller where it would leave the picture."""
    filtered: Evaluation
    """The filtered estimates against the truth."""
    single_frame: Evaluation
    """The estimates of single frames against the truth."""
    bound: NDArray[np.float64]
    """(order + 1,) Cramer-Rao bound of a single frame's error, as errors are stated: relative to |L~_0|."""


def accuracy_table(settings: AccuracySettings, probe: Probe) -> Iterator[AccuracyCell]:
    """Film the sheet from every tilt and distance, estimate, and compare with the truth.

    Args:
        settings: what is filmed.
        probe: the sheet.

    Yields:
        One cell for each tilt and width, tilts outermost.

    Raises:
        RenderingUnavailableError: there is no headless OpenGL.
    """
    layers = SheetLayers.of_probe(probe)
    for tilt in settings.tilts_deg:
        for width in settings.widths_px:
            seconds = float(settings.frames / settings.footage.frame_rate)
            footage = replace(settings.footage, tilt_deg=tilt, sheet_width_px=width, duration_s=seconds)
            yield _measure(footage, probe, layers)


def _measure(footage: SynthesisSettings, probe: Probe, layers: SheetLayers) -> AccuracyCell:
    camera = footage.filming_camera
    tracker = LightingTracker(probe, camera, TrackerSettings(order="all"))
    header = LogHeader.of(probe, camera, "synthetic", "designed")
    filtered, single, truths, bounds = [], [], [], []
    bound = _FrameBound(probe, footage)
    for synthetic in synthesize(footage, probe, layers):
        estimate = tracker.update(synthetic.frame)
        filtered.append(LogRecord.of(estimate, estimate.timings_s))
        single.append(LogRecord.of(replace(estimate, lighting=estimate.raw), estimate.timings_s))
        truths.append(synthetic.truth)
        bounds.append(bound.relative(synthetic))
    truth = ClipTruth(footage.environment, probe.frequencies, tuple(truths))
    return AccuracyCell(
        tilt_deg=footage.tilt_deg or 0.0,
        width_px=footage.sheet_width_px,
        filtered=evaluate(LightingLog(header, tuple(filtered), truncated=False), truth),
        single_frame=evaluate(LightingLog(header, tuple(single), truncated=False), truth),
        bound=np.median(bounds, axis=0),
    )


class _FrameBound:
    """The Cramer-Rao bound of synthetic frames, whose pose and noise are known."""

    def __init__(self, probe: Probe, footage: SynthesisSettings) -> None:
        self._bound = CramerRaoBound(probe)
        self._meter = BlockMeter(probe, footage.filming_camera)
        self._sensor = footage.sensor
        self._order = frequency_order(probe.frequencies)

    def relative(self, synthetic: SyntheticFrame) -> NDArray[np.float64]:
        """Bound (order + 1,) on the error of each order, relative to |L~_0|."""
        truth, blur = synthetic.truth, self._sensor.blur_px
        means = self._meter.measure(synthetic.frame, truth.pose, blur)
        variance = sensor_variance(means.values[:, 0], self._sensor.read_noise, self._sensor.gain)
        stddev = self._bound.stddev(means, variance, blur**2)
        level = np.sqrt(np.mean(np.abs(truth.coefficients[0]) ** 2))
        squares = [np.mean(stddev[self._order == order] ** 2) for order in range(self._order.max() + 1)]
        return np.sqrt(squares) / level
