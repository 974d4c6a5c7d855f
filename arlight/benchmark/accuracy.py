"""The accuracy table: error per order over camera tilts and sheet widths, on synthesised footage."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from arlight.benchmark.evaluation import Evaluation, evaluate
from arlight.lighting_tracker import LightingTracker
from arlight.probe.design import Probe
from arlight.results.log import LightingLog
from arlight.results.record import LogHeader, LogRecord
from arlight.synthetic.settings import SynthesisSettings
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.synthesis import synthesize
from arlight.synthetic.truth import ClipTruth


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


def accuracy_table(settings: AccuracySettings, probe: Probe) -> Iterator[AccuracyCell]:
    """Film the sheet from every tilt and distance, estimate, and compare with the truth.

    Args:
        settings: what is filmed.
        probe: the sheet.

    Yields:
        One cell for each tilt and width, tilts outermost.

    Raises:
        RenderingUnavailable: there is no headless OpenGL.
    """
    layers = SheetLayers.of_probe(probe)
    for tilt in settings.tilts_deg:
        for width in settings.widths_px:
            seconds = float(settings.frames / settings.footage.frame_rate)
            footage = replace(settings.footage, tilt_deg=tilt, sheet_width_px=width, duration_s=seconds)
            yield _measure(footage, probe, layers)


def _measure(footage: SynthesisSettings, probe: Probe, layers: SheetLayers) -> AccuracyCell:
    camera = footage.filming_camera
    tracker = LightingTracker(probe, camera)
    header = LogHeader.of(probe, camera, "synthetic", "designed")
    filtered, single, truths = [], [], []
    for synthetic in synthesize(footage, probe, layers):
        estimate = tracker.update(synthetic.frame)
        filtered.append(LogRecord.of(estimate, estimate.timings_s))
        single.append(LogRecord.of(replace(estimate, lighting=estimate.raw), estimate.timings_s))
        truths.append(synthetic.truth)
    truth = ClipTruth(footage.environment, probe.frequencies, tuple(truths))
    return AccuracyCell(
        tilt_deg=footage.tilt_deg or 0.0,
        width_px=footage.sheet_width_px,
        filtered=evaluate(LightingLog(header, tuple(filtered), truncated=False), truth),
        single_frame=evaluate(LightingLog(header, tuple(single), truncated=False), truth),
    )
