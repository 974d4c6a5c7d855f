"""A synthetic clip on disk: NAME.mp4, its truth, its sheet and its camera."""

from collections.abc import Callable
from itertools import chain
from pathlib import Path

from arlight.errors import OutputError
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.probe.storage import save_probe
from arlight.synthetic.settings import CRF, SynthesisSettings
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.synthesis import SyntheticFrame, synthesize
from arlight.synthetic.truth import ClipTruth, FrameTruth, save_truth
from arlight.video.writer import VideoWriter

PRESET = "slow"
TUNE = "psnr"
"""Measured values matter more than looks, and nobody waits for the frames."""


def write_clip(
    folder: Path | str,
    name: str,
    settings: SynthesisSettings,
    probe: Probe,
    layers: SheetLayers | None = None,
    assembly: Assembly | None = None,
    crf: int = CRF,
    preset: str = PRESET,
    watch: Callable[[SyntheticFrame], None] | None = None,
) -> ClipTruth:
    """Film a sheet into NAME.mp4, with NAME.truth.json, probe.json and camera.json beside it.

    Clips in one folder share probe.json and camera.json; a clip of another sheet or camera gets NAME.probe.json or
    NAME.camera.json. The truth covers every frame that was written, also when filming is interrupted.

    Args:
        folder: made where it does not exist.
        name: of the clip, without an ending.
        settings: light, path, camera, sensor.
        probe: the sheet.
        layers, assembly: its printed layers, and how they were put together, as in `synthesize`.
        crf: quality of libx264, lower is better.
        preset: speed of libx264.
        watch: called with every frame after it was written.

    Returns:
        The truth, as written.

    Raises:
        OutputError: the clip is there already, or a file cannot be written.
        EnvironmentMapError: the light cannot be loaded.
        RenderingUnavailableError: there is no headless OpenGL.
    """
    folder = _made(Path(folder))
    video, truth_file = folder / f"{name}.mp4", folder / f"{name}.truth.json"
    for path in (video, truth_file, folder / f"{name}.probe.json", folder / f"{name}.camera.json"):
        if path.exists():
            raise OutputError(f"{path}: is there already; choose another name or folder, or remove it first")
    frames: list[FrameTruth] = []
    source = synthesize(settings, probe, layers, assembly)
    # light and OpenGL are refused before anything is written
    first = next(source)
    _write_sidecar(folder, name, "probe", lambda path: save_probe(probe, path))
    _write_sidecar(folder, name, "camera", settings.filming_camera.save)
    try:
        with VideoWriter(video, frame_rate=settings.frame_rate, crf=crf, preset=preset, tune=TUNE) as writer:
            for synthetic in chain([first], source):
                writer.write(synthetic.frame)
                frames.append(synthetic.truth)
                if watch is not None:
                    watch(synthetic)
    finally:
        source.close()
        truth = ClipTruth(_light_name(settings), probe.frequencies, tuple(frames))
        if frames:
            save_truth(truth, truth_file)
    return truth


def _light_name(settings: SynthesisSettings) -> str:
    names = [settings.environment]
    if settings.light in ("switch", "fade") and settings.second_environment is not None:
        names.append(settings.second_environment)
    return " + ".join(Path(name).stem for name in names)


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made ({error.strerror}); choose another folder") from error
    return folder


def _write_sidecar(folder: Path, name: str, kind: str, save: Callable[[Path], None]) -> None:
    """Write KIND.json, or NAME.KIND.json where there is another KIND.json already."""
    shared, own = folder / f"{kind}.json", folder / f"{name}.{kind}.json"
    target = own if shared.exists() else shared
    try:
        save(target)
        if target is own and own.read_bytes() == shared.read_bytes():
            own.unlink()
    except OSError as error:
        raise OutputError(f"{target}: cannot be written ({error.strerror}); choose another folder") from error
