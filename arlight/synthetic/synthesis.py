"""Frames of a moving camera over a lit sheet, with their truth."""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.synthetic.assembled import assembled_layers
from arlight.synthetic.captured import load_environment
from arlight.synthetic.light_script import LightScript, TrueLight, exposure_for
from arlight.synthetic.motion import CameraMotion
from arlight.synthetic.renderer import Sampling
from arlight.synthetic.settings import SynthesisSettings
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.stage import Stage
from arlight.synthetic.truth import FrameTruth
from arlight.video.frame import Frame


@dataclass(frozen=True, slots=True)
class SyntheticFrame:
    """A picture and what is true of it."""

    frame: Frame
    """8-bit sRGB picture."""
    truth: FrameTruth
    """Pose, light and exposure."""


def synthesize(
    settings: SynthesisSettings, probe: Probe, layers: SheetLayers | None = None, assembly: Assembly | None = None
) -> Generator[SyntheticFrame]:
    """Film a sheet.

    1. The light's keys become irradiance of the paper, by FFT, when they are first needed.
    2. A shader draws what the camera sees, cross-fading two keys.
    3. The sensor, under the exposure of the moment, blurs it, adds noise and encodes it.

    Args:
        settings: light, path, camera, sensor.
        probe: the sheet.
        layers: its printed layers; drawn from the probe's design, or from the assembly, by default.
        assembly: how it was printed and put together; exactly as designed by default.

    Yields:
        The frames in order. The iterator belongs to the thread that asks for its first frame.

    Raises:
        EnvironmentMapError: the light cannot be loaded.
        RenderingUnavailableError: there is no headless OpenGL.
    """
    camera = settings.filming_camera
    captured = captured_light(settings)
    exposure = exposure_for(captured, probe.paper_reflectance, settings.white)
    script = captured.scaled(exposure)
    light = TrueLight(script, probe.slab, probe.frequencies)
    motion = CameraMotion(settings.path, settings.sheet_width_px, settings.tilt_deg, settings.duration_s, settings.seed)
    noise = np.random.default_rng(settings.seed)
    sampling = Sampling(settings.sample_mm, settings.samples_per_side)
    assembly = assembly or Assembly()
    printed = assembled_layers(probe, assembly) if layers is None else layers
    stage = Stage(printed, assembly.slab(probe), camera, script, settings.bounces, sampling)
    try:
        for index in range(settings.frame_count):
            time_s = float(index / settings.frame_rate)
            pose = motion.pose(time_s, camera, probe.sheet_mm)
            gain = settings.gain(time_s)
            radiance = stage.picture(time_s, pose) * gain.astype(np.float32)
            image = settings.sensor.expose(radiance, camera, noise)
            truth = FrameTruth(pose, light.coefficients(time_s) * gain, exposure * float(gain[1]), time_s)
            yield SyntheticFrame(Frame.from_rgb(image, index, time_s), truth)
    finally:
        stage.close()


def captured_light(settings: SynthesisSettings) -> LightScript:
    """The light of the settings, before exposure.

    Raises:
        EnvironmentMapError: an environment cannot be loaded.
    """
    second = None
    if settings.second_environment is not None:
        second = load_environment(settings.second_environment).rotated(np.deg2rad(settings.second_yaw_deg))
        second = second.scaled(settings.second_gain)
    return LightScript(
        environment=load_environment(settings.environment).rotated(np.deg2rad(settings.yaw_deg)),
        name=settings.light,
        turn_deg_per_s=settings.turn_deg_per_s,
        second=second,
        change_s=settings.duration_s / 2.0 if settings.change_s is None else settings.change_s,
        fade_s=settings.fade_s,
    )
