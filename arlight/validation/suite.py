"""The proof's clips: one assembled sheet under twelve soft captured lights, on moving, known and fixed views."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import OutputError
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.synthetic.motion import Stand
from arlight.validation.assembled_layers import AssembledLayers, assembled_layers
from arlight.validation.camera_view import LitSheet
from arlight.validation.filming import ProofSensor, TracedPath, assembled_by_hand, pose_at, proof_camera, stand_on
from arlight.validation.paper_light import GatherSettings, gather_irradiance
from arlight.validation.proof_lights import KNOWN_LIGHTS, TEST_LIGHTS, ProofLight, proof_light
from arlight.validation.traced_clip import CRF, film, save_setting

Report = Callable[[str], None]

PATH_SEEDS: dict[TracedPath, int] = {"orbit": 1, "dive": 2, "hand": 3}
_KNOWN_VIEWS = 3
_FIXED = Stand(20.0, -75.0)
_AWAY_DEG = (0.0, 2.0, 5.0, 10.0, 20.0)
_FIXED_FRAMES = 3


@dataclass(frozen=True)
class ProofStage:
    """Sheet, lights and camera of the proof; the light in the sheet is gathered once."""

    probe: Probe
    """As designed."""
    layers: AssembledLayers
    """As assembled."""
    camera: Camera
    """That films; its vignetting is in it."""
    lights: tuple[ProofLight, ...]
    """Those of the tests first."""
    irradiance: NDArray[np.float32]
    """(lights, 3, rows, columns) of the paper."""

    def film_path(self, folder: Path, path: TracedPath, frames: int = 30) -> list[str]:
        """Film a camera path under the test lights: PATH-LIGHT.mp4; returns the clips' names."""
        poses = [self._pose(stand_on(path, along)) for along in np.linspace(0.0, 1.0, frames)]
        return self._film(folder, path, poses, TEST_LIGHTS, PATH_SEEDS[path])

    def film_known(self, folder: Path) -> list[str]:
        """Film three views under each of the known lights, 15 to 50 degrees off the normal: known-LIGHT.mp4."""
        names = []
        for index, name in enumerate(KNOWN_LIGHTS):
            poses = [self._pose(_known_stand(_KNOWN_VIEWS * index + view)) for view in range(_KNOWN_VIEWS)]
            names += self._film(folder, "known", poses, [name], 100 + index)
        return names

    def film_fixed(self, folder: Path) -> list[str]:
        """Film every light from one view, the test lights also from others: fixed-LIGHT.mp4, away-LIGHT.mp4."""
        poses = [self._pose(_FIXED)] * _FIXED_FRAMES
        away = [self._pose(Stand(_FIXED.tilt_deg + tilt, _FIXED.azimuth_deg)) for tilt in _AWAY_DEG]
        names = [self._film(folder, "fixed", poses, [light.name], 200 + k) for k, light in enumerate(self.lights)]
        return [name for clip in names for name in clip] + self._film(folder, "away", away, TEST_LIGHTS, 300)

    def film_control(self, folder: Path, light: str = "hall", frames: int = 30) -> list[str]:
        """The orbit of one light without noise and without loss by the codec: control-LIGHT.mp4."""
        poses = [self._pose(stand_on("orbit", along)) for along in np.linspace(0.0, 1.0, frames)]
        return self._film(folder, "control", poses, [light], 400, ProofSensor(noisy=False), crf=0)

    def _pose(self, stand: Stand) -> Pose:
        return pose_at(stand, self.camera, self.probe.sheet_mm)

    def _film(
        self,
        folder: Path,
        prefix: str,
        poses: Sequence[Pose],
        names: Sequence[str] | dict[str, float],
        seed: int,
        sensor: ProofSensor | None = None,
        crf: int = CRF,
    ) -> list[str]:
        chosen = [index for index, light in enumerate(self.lights) if light.name in names]
        lights = [self.lights[index] for index in chosen]
        environments = [light.environment for light in lights]
        sheet = LitSheet.of(self.probe, self.layers, environments, np.asarray(self.irradiance[chosen]))
        clips = [f"{prefix}-{light.name}" for light in lights]
        film(folder, clips, poses, sheet, lights, self.camera, self.probe, sensor=sensor, crf=crf, seed=seed)
        return clips


def set_stage(
    folder: Path,
    captured: Path,
    assembly: Assembly | None = None,
    lights: dict[str, float] | None = None,
    settings: GatherSettings | None = None,
    halftone_dpi: float | None = 600.0,
) -> ProofStage:
    """Write lights, probe.json, camera.json and assembly.json, and gather the light in the sheet.

    Args:
        folder: of the clips.
        captured: folder of the captured environments.
        assembly: how the sheet was assembled; `assembled_by_hand` by default.
        lights: which lights, and how far each is turned [deg]; all twelve by default.
        settings: how densely the light is gathered.
        halftone_dpi: resolution of the bilevel printer; None for continuous tone.

    Raises:
        ValidationUnavailableError: Mitsuba is not there.
        EnvironmentMapError: a captured environment is missing.
        OutputError: a file cannot be written.
    """
    probe, camera = design_probe(), proof_camera()
    assembly = assembled_by_hand() if assembly is None else assembly
    save_setting(folder, probe, camera, assembly)
    target = folder / "lights"
    target.mkdir(exist_ok=True)
    layers = assembled_layers(probe, assembly, halftone_dpi)
    turns = TEST_LIGHTS | KNOWN_LIGHTS if lights is None else lights
    known = [proof_light(name, turn, captured, target, layers.slab, probe) for name, turn in turns.items()]
    _describe(target, known)
    irradiance = gather_irradiance(layers, [light.environment for light in known], settings)
    return ProofStage(probe, layers, camera, tuple(known), irradiance)


def trace_proof(folder: Path, captured: Path, report: Report) -> None:
    """Make all clips of the proof.

    Args:
        folder: to write to.
        captured: folder of the captured environments.
        report: told the name of each clip when it is finished.

    Raises:
        ArlightError: as `set_stage`, or a clip cannot be written.
    """
    stage = set_stage(folder, captured)
    for path in PATH_SEEDS:
        _tell(report, stage.film_path(folder, path))
    for make in (stage.film_known, stage.film_fixed, stage.film_control):
        _tell(report, make(folder))
    perfect = set_stage(folder / "perfect", captured, Assembly(), TEST_LIGHTS, halftone_dpi=None)
    _tell(report, [f"perfect/{name}" for name in perfect.film_path(folder / "perfect", "orbit")])


def _known_stand(index: int) -> Stand:
    """Views spread over 15 to 50 degrees off the normal and a hundred degrees of azimuth before the sheet."""
    first, second = (0.5 + index * 0.7548776662466927) % 1.0, (0.5 + index * 0.5698402909980532) % 1.0
    return Stand(15.0 + 40.0 * first, -140.0 + 100.0 * second, roll_deg=6.0 * (first + second - 1.0))


def _describe(folder: Path, lights: Sequence[ProofLight]) -> None:
    """lights.json: exposure and coefficients of the soft maps, which need no further turn."""
    content = {
        light.name: {
            "file": f"{light.name}.hdr",
            "yaw_deg": 0.0,
            "exposure": light.exposure,
            "coefficients_re": np.round(light.coefficients.real, 7).tolist(),
            "coefficients_im": np.round(light.coefficients.imag, 7).tolist(),
        }
        for light in lights
    }
    path = folder / "lights.json"
    try:
        path.write_text(json.dumps(content) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another folder") from error


def _tell(report: Report, names: Sequence[str]) -> None:
    for name in names:
        report(name)
