"""A camera that moves over a misassembled sheet of order 2, drawn by the renderer: no closed form of ours in it."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest

from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.layers.self_calibration import SelfCalibration, self_calibrate
from arlight.calibration.layers.sheet_view import SheetView
from arlight.calibration.layers.view_measurement import SeenSheet, ViewMeter, find_sheet
from arlight.camera import Camera
from arlight.errors import RenderingUnavailableError
from arlight.estimation.resampling import measured_frequencies
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.synthetic.captured import load_environment
from arlight.synthetic.sensor import Sensor
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.synthesis import synthesize
from arlight.synthetic.truth import FrameTruth
from arlight.video.frame import Frame

MISASSEMBLED = Assembly(
    Print(Registration((0.06, -0.05), 0.2), blur_mm=0.05, dot_gain=0.06, solid=0.015),
    Print(Registration((-0.07, 0.09), -0.25), blur_mm=0.08, dot_gain=0.08, solid=0.03),
    glass_scale=1.025,
)
LIGHT = "studio"
FRAMES = 8


@dataclass(frozen=True)
class FilmedSheet:
    """Frames of one sheet under one light, where it was found in them, and its truth."""

    probe: Probe
    camera: Camera
    assembly: Assembly
    frames: list[Frame]
    truth: list[FrameTruth]
    seen: list[SeenSheet]


@pytest.fixture(scope="session")
def filmed_sheet() -> FilmedSheet:
    probe = design_probe(order=2, pixels_per_mm=12)
    settings = SynthesisSettings(
        environment=LIGHT,
        path="orbit",
        camera=default_camera((640, 480)),
        sheet_width_px=420.0,
        duration_s=2.0,
        frame_rate=Fraction(FRAMES, 2),
        sensor=Sensor(blur_px=0.6, read_noise=0.001, gain=1e-5),
        samples_per_side=3,
    )
    try:
        filmed = list(synthesize(settings, probe, assembly=MISASSEMBLED))
    except RenderingUnavailableError as error:
        pytest.skip(f"no headless OpenGL through EGL: {error}")
    frames = [synthetic.frame for synthetic in filmed]
    seen = find_sheet(frames, probe, settings.filming_camera)
    return FilmedSheet(
        probe, settings.filming_camera, MISASSEMBLED, frames, [synthetic.truth for synthetic in filmed], seen
    )


@pytest.fixture(scope="session")
def self_calibrated(filmed_sheet: FilmedSheet) -> SelfCalibration:
    return self_calibrate(filmed_sheet.seen, filmed_sheet.probe, filmed_sheet.camera)


@pytest.fixture(scope="session")
def measured_views(filmed_sheet: FilmedSheet) -> list[SheetView]:
    """The views, measured with the film where it is."""
    meter = ViewMeter(filmed_sheet.probe, filmed_sheet.camera, filmed_sheet.assembly)
    return [meter.measure(seen) for seen in filmed_sheet.seen]


@pytest.fixture(scope="session")
def true_light(filmed_sheet: FilmedSheet) -> np.ndarray:
    """(2k - 1,) real-packed green coefficients of the light, at the frequencies that the assembled sheet measures."""
    environment = load_environment(LIGHT).scaled(filmed_sheet.truth[0].exposure)
    light = KnownLight(LIGHT, environment, filmed_sheet.probe.refractive_index)
    return light.packed(measured_frequencies(filmed_sheet.probe, filmed_sheet.assembly))[:, 1]
