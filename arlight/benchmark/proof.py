"""Calibrations judged on clips of an imperfect sheet whose light is known: error, honesty, and what each flaw costs.

The clips are path-traced (`arlight trace`), so nothing of the estimator's formulas is in them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.consistency import consistency
from arlight.calibration.layers.self_calibration import SelfCalibration
from arlight.camera import Camera
from arlight.errors import VideoError
from arlight.estimation.lighting import Lighting
from arlight.fourier import frequency_order
from arlight.lighting_tracker import LightingTracker, TrackerSettings
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.design import Probe
from arlight.synthetic.truth import load_truth
from arlight.video.reader import VideoReader

Array = NDArray[np.float64]

GROUPS = {"0": (0, 0), "1-3": (1, 3), "4-5": (4, 5)}
"""Sets of orders whose error is stated together, first and last."""
SETTLING_FRAMES = 10


@dataclass(frozen=True, slots=True)
class Treatment:
    """What is believed of sheet and camera."""

    name: str
    """Shown in the table."""
    assembly: Assembly | None
    """The sheet; None for exactly as designed."""
    camera: Camera
    """The camera, with the vignetting that is divided out."""
    settings: TrackerSettings = field(default_factory=lambda: TrackerSettings(order="all"))
    """Of the estimation."""


@dataclass(frozen=True, slots=True)
class ClipResult:
    """One clip under one treatment."""

    clip: str
    """Name of the clip."""
    treatment: str
    """Name of the treatment."""
    errors: dict[str, list[float]]
    """Error of every settled frame for each of `GROUPS`, relative to |L~_0|."""
    green: dict[str, list[float]]
    """The same of green alone, which video keeps at full resolution."""
    normalised_raw: float
    """Error squared over the reported covariance, a degree of freedom, of single frames."""
    normalised_filtered: float
    """The same after the temporal filter."""


def judge(clip: Path, probe: Probe, treatment: Treatment) -> ClipResult:
    """Follow the light through a clip and compare it with the truth beside it.

    Raises:
        VideoError: the clip cannot be read, or shows the sheet in no frame after the first ten.
        TruthError: its truth is missing or cannot be used.
    """
    truth = load_truth(clip.with_suffix(".truth.json"))
    tracker = LightingTracker(probe, treatment.camera, treatment.settings, treatment.assembly)
    raw: list[Lighting] = []
    filtered: list[Lighting] = []
    true: list[NDArray[np.complex128]] = []
    with VideoReader(clip) as reader:
        for number, frame in enumerate(reader):
            estimate = tracker.update(frame)
            if number >= SETTLING_FRAMES and estimate.raw is not None and estimate.lighting is not None:
                raw.append(estimate.raw)
                filtered.append(estimate.lighting)
                true.append(truth.frames[number].coefficients)
    if not true:
        raise VideoError(f"{clip}: shows the sheet in no frame after the first {SETTLING_FRAMES}; is it the right one?")
    orders = frequency_order(probe.frequencies)
    errors = np.array([e.coefficients - t for e, t in zip(filtered, true, strict=True)])
    level = np.array([np.sqrt(np.mean(np.abs(t[0]) ** 2)) for t in true])
    return ClipResult(
        clip.stem,
        treatment.name,
        _grouped(errors, level, orders),
        _grouped(errors[..., 1:2], np.array([np.abs(t[0, 1]) for t in true]), orders),
        consistency(raw, true).full,
        consistency(filtered, true).full,
    )


def calibrated(name: str, found: SelfCalibration, camera: Camera) -> Treatment:
    """What self-calibration found, with its vignetting on top of the camera's."""
    return Treatment(name, found.assembly, camera.with_more_vignetting(found.vignetting))


def uncorrected(whole: Treatment) -> Iterator[Treatment]:
    """The treatment with one flaw of the sheet or the camera at a time left uncorrected."""
    sheet = whole.assembly or Assembly()
    film, paper = sheet.film, sheet.paper
    turned = replace(paper.registration, rotation_deg=film.registration.rotation_deg)
    shifted = replace(paper.registration, shift_mm=film.registration.shift_mm)
    yield replace(whole, name="shift of the paper", assembly=replace(sheet, paper=replace(paper, registration=shifted)))
    yield replace(whole, name="turn of the paper", assembly=replace(sheet, paper=replace(paper, registration=turned)))
    yield replace(
        whole, name="place of the film",
        assembly=replace(
            sheet,
            film=replace(film, registration=Registration()),
            paper=replace(paper, registration=_relative(film, paper)),
        ),
    )  # fmt: skip
    yield replace(whole, name="thickness of the glass", assembly=replace(sheet, glass_scale=1.0))
    for name, undone in (
        ("print blur", lambda layer: replace(layer, blur_mm=0.0)),
        ("dot gain", lambda layer: replace(layer, dot_gain=0.0)),
        ("grey ink", lambda layer: replace(layer, solid=0.0)),
    ):
        yield replace(whole, name=name, assembly=replace(sheet, film=undone(film), paper=undone(paper)))
    yield replace(whole, name="vignetting", camera=replace(whole.camera, vignetting=None))
    yield replace(whole, name="light bounced in the sheet", settings=replace(whole.settings, bounces=False))


def medians(results: Sequence[ClipResult], treatment: str, *, green: bool = False) -> dict[str, float]:
    """Median error of each group of orders over all frames of all clips under a treatment."""
    own = [result.green if green else result.errors for result in results if result.treatment == treatment]
    return {group: float(np.median(np.concatenate([errors[group] for errors in own]))) for group in GROUPS}


def _relative(film: Print, paper: Print) -> Registration:
    """The paper's place as seen from the film."""
    shift = np.array(paper.registration.shift_mm) - film.registration.shift_mm
    turn = paper.registration.rotation_deg - film.registration.rotation_deg
    scale = paper.registration.scale / film.registration.scale
    return Registration((float(shift[0]), float(shift[1])), turn, scale)


def _grouped(errors: NDArray[np.complex128], level: Array, orders: NDArray[np.int64]) -> dict[str, list[float]]:
    """Rms error of each group and frame from errors (frames, k, channels), relative to the level (frames,)."""
    grouped = {}
    for group, (first, last) in GROUPS.items():
        inside = np.abs(errors[:, (orders >= first) & (orders <= last)]) ** 2
        grouped[group] = (np.sqrt(np.mean(inside, axis=(1, 2))) / level).tolist() if inside.size else []
    return grouped
