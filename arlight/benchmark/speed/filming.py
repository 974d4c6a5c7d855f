"""Films the workloads: clips in a folder, with their truth, sheet and camera beside them.

A cycle goes there and back, so that a clip can be played for as long as it takes without a jump. Workloads of one scene
share its pictures; only the sensor and the compression are theirs.
"""

import hashlib
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.speed.workloads import FRAME_RATE, Scene, Workload
from arlight.camera import Camera
from arlight.environment import Environment
from arlight.errors import OutputError
from arlight.probe.storage import save_probe
from arlight.synthetic.light_script import TrueLight
from arlight.synthetic.renderer import Sampling, SheetRenderer
from arlight.synthetic.settings import default_camera
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.transport import IrradianceMap, LightTransport
from arlight.synthetic.truth import ClipTruth, FrameTruth, save_truth
from arlight.video.frame import Frame
from arlight.video.writer import VideoWriter

CLIP_NAME = "clip.mp4"
TRUTH_NAME = "clip.truth.json"

_SEED = 20
_SAMPLING = Sampling(spacing_mm=0.2)
_PRESET = "veryfast"


def clip_folder(folder: Path, workload: Workload) -> Path:
    """Where a workload's clip is: what it was filmed with tells its name."""
    return folder / hashlib.sha256(repr(workload).encode()).hexdigest()[:16]


def film(workloads: Sequence[Workload], folder: Path, watch: Callable[[str], None]) -> None:
    """Film the workloads that are not in the folder yet.

    Args:
        workloads: what is to be filmed, in any order.
        folder: exists; each clip gets a folder of its own.
        watch: called with a workload's name when it is about to be filmed and once it is done.

    Raises:
        OutputError: the folder cannot be written to.
        RenderingUnavailableError: there is no headless OpenGL.
    """
    studio = _Studio()
    missing = [workload for workload in workloads if not (clip_folder(folder, workload) / TRUTH_NAME).exists()]
    for scene, group in groupby(sorted(missing, key=lambda w: repr(w.scene)), key=lambda w: w.scene):
        together = list(group)
        pictures: dict[float, NDArray[np.float32]] = {}
        for workload in together:
            watch(workload.name)
            times = [workload.time_s(index) for index in range(workload.cycle)]
            if not set(times) <= pictures.keys():
                pictures.update(studio.pictures(scene, sorted(set(times) - pictures.keys())))
            _write(workload, pictures, studio.camera(scene), clip_folder(folder, workload))


class _Studio:
    """Pictures of scenes; what several scenes have in common is worked out once."""

    def __init__(self) -> None:
        self._transport = lru_cache(maxsize=2)(_transport)
        self._irradiance = lru_cache(maxsize=4)(self._light_key)

    def camera(self, scene: Scene) -> Camera:
        return default_camera(scene.size)

    def pictures(self, scene: Scene, times_s: Sequence[float]) -> dict[float, NDArray[np.float32]]:
        """Linear radiance (h, w, 3) by the time it is seen."""
        probe, camera, script, motion = scene.probe, self.camera(scene), scene.light, scene.motion
        transport = self._transport(scene.order, scene.april_tags)
        renderer = SheetRenderer(transport.layers, probe.slab, camera, _SAMPLING)
        shown: dict[str, int] = {}
        pictures: dict[float, NDArray[np.float32]] = {}
        try:
            for time_s in times_s[:1] if scene.still else times_s:
                first, second, share = script.state(time_s)
                for slot, key in (("first", first), ("second", second)):
                    if shown.get(slot) != key:
                        renderer.set_light(slot, *self._irradiance(scene, key))  # type: ignore[arg-type]
                        shown[slot] = key
                pictures[time_s] = renderer.render(motion.pose(time_s, camera, probe.sheet_mm), share).copy()
        finally:
            renderer.release()
        return {time_s: pictures[times_s[0]] if scene.still else pictures[time_s] for time_s in times_s}

    def _light_key(self, scene: Scene, key: int) -> tuple[Environment, IrradianceMap]:
        environment = scene.light.key(key)
        return environment, self._transport(scene.order, scene.april_tags).irradiance(environment)


def _transport(order: int, april_tags: bool) -> LightTransport:
    probe = Scene(order=order, april_tags=april_tags).probe
    return LightTransport(SheetLayers.of_probe(probe), probe.slab)


def _write(workload: Workload, pictures: dict[float, NDArray[np.float32]], camera: Camera, folder: Path) -> None:
    """The clip with all that belongs to it; the truth last, by which a finished clip is known."""
    scene, probe = workload.scene, workload.scene.probe
    light, motion = TrueLight(scene.light, probe.slab, probe.frequencies), scene.motion
    noise = np.random.default_rng(_SEED)
    truths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        save_probe(probe, folder / "probe.json")
        camera.save(folder / "camera.json")
        with VideoWriter(
            folder / CLIP_NAME, frame_rate=FRAME_RATE, crf=workload.crf, preset=_PRESET, tune="psnr"
        ) as writer:
            for index in range(workload.cycle):
                time_s = workload.time_s(index)
                image = workload.sensor.expose(pictures[time_s], camera, noise)
                shown_s = float(index / FRAME_RATE)
                writer.write(Frame.from_rgb(image, index, shown_s))
                pose = motion.pose(time_s, camera, probe.sheet_mm)
                truths.append(FrameTruth(pose, light.coefficients(time_s), 1.0, shown_s))
        save_truth(ClipTruth(scene.environment, probe.frequencies, tuple(truths)), folder / TRUTH_NAME)
    except OSError as error:
        raise OutputError(
            f"{folder}: frames cannot be kept there ({error.strerror}); free space or use --frames"
        ) from error
