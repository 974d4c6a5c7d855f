"""Path-traced clips on disk: NAME.mp4, its truth, the assembled sheet's truth, and shared probe and camera files."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import OutputError
from arlight.probe.assembly import Assembly
from arlight.probe.assembly_storage import save_assembly
from arlight.probe.design import Probe
from arlight.probe.storage import save_probe
from arlight.synthetic.truth import ClipTruth, FrameTruth, save_truth
from arlight.validation.camera_view import LitSheet
from arlight.validation.filming import ProofSensor
from arlight.validation.proof_lights import ProofLight
from arlight.video.frame import Frame
from arlight.video.writer import VideoWriter

FRAME_RATE = Fraction(15)
CRF = 18
PRESET = "medium"
TUNE = "psnr"


def film(
    folder: Path,
    names: Sequence[str],
    poses: Sequence[Pose],
    sheet: LitSheet,
    lights: Sequence[ProofLight],
    camera: Camera,
    probe: Probe,
    *,
    sensor: ProofSensor | None = None,
    crf: int = CRF,
    seed: int = 0,
) -> list[ClipTruth]:
    """Film one camera path under every light of a sheet at the same time.

    Args:
        folder: of the clips.
        names: of the clips, one a light.
        poses: one a frame, camera_from_probe [mm].
        sheet: the lit sheet.
        lights: its lights, in its order.
        camera: that films.
        probe: gives the coefficients' frequencies.
        sensor: of the camera.
        crf: quality of libx264; 0 is without loss but for the colours' subsampling.
        seed: of noise and jitter.

    Returns:
        The clips' truths, as written.
    """
    sensor = sensor or ProofSensor()
    generator = np.random.default_rng(seed)
    writers = [
        VideoWriter(folder / f"{name}.mp4", frame_rate=FRAME_RATE, crf=crf, preset=PRESET, tune=TUNE) for name in names
    ]
    try:
        for index, pose in enumerate(poses):
            time_s = float(index / FRAME_RATE)
            radiance = sheet.picture(camera, pose, seed=seed * 1000 + index)
            for writer, linear in zip(writers, radiance, strict=True):
                writer.write(Frame.from_rgb(sensor.expose(linear, camera, generator), index, time_s))
    finally:
        for writer in writers:
            writer.close()
    truths = [_truth(light, poses, probe.frequencies) for light in lights]
    for name, truth in zip(names, truths, strict=True):
        save_truth(truth, folder / f"{name}.truth.json")
    return truths


def save_setting(folder: Path, probe: Probe, camera: Camera, assembly: Assembly) -> None:
    """Write probe.json, camera.json and assembly.json.

    Raises:
        OutputError: a file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        save_probe(probe, folder / "probe.json")
        camera.save(folder / "camera.json")
        save_assembly(assembly, folder / "assembly.json")
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error.strerror}); choose another folder") from error


def _truth(light: ProofLight, poses: Sequence[Pose], frequencies: NDArray[np.int64]) -> ClipTruth:
    frames = tuple(
        FrameTruth(pose, light.coefficients, light.exposure, float(index / FRAME_RATE))
        for index, pose in enumerate(poses)
    )
    return ClipTruth(light.name, frequencies, frames)
