"""A clip with the probe and the camera that belong to it, and what to say when the sheet was never seen."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera
from arlight.commands.options.footage import FootageOptions, SheetAndCamera
from arlight.commands.sheet_calibration import calibration_of
from arlight.errors import ArlightError, CalibrationError, CameraError, ProbeError, VideoError
from arlight.estimation.fixed_estimator import FixedEstimator
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.probe.storage import load_probe
from arlight.results.statistics import RunStatistics
from arlight.tracking.recognition import ids_text, markers_of, recognise_markers, same_family
from arlight.video.reader import VideoReader
from arlight.video.sidecars import find_sidecar

# pictures that are searched for other sheets' markers, spread over the clip
_SEARCHED = 8
# the probe's own sheet leaves 0.01 to 0.1 of the stripes, 0.25 when the video is compressed until they are torn; other
# phases, patterns or glass leave 0.45 or more
_UNEXPLAINED_LIMIT = 0.35


@dataclass(frozen=True, slots=True)
class Footage:
    """A clip that is open, its sheet and its camera."""

    reader: VideoReader
    """The clip."""
    probe: Probe
    """The sheet that was filmed."""
    camera: Camera
    """The camera that filmed it."""
    probe_path: Path
    """Where the probe was read from."""
    camera_path: Path | None
    """Where the camera was read from; None when it was estimated from the clip."""
    calibration_path: Path | None = None
    """Where the sheet's calibration was read from; None without one, or where it was made from the clip."""
    assembly: Assembly | None = None
    """The sheet as it was printed and put together; None for exactly as designed."""
    fixed: FixedEstimator | None = None
    """The paper's L = MV, where it was asked for."""
    notes: tuple[str, ...] = ()
    """What the user should know of how probe, camera and calibration were come by."""

    def __enter__(self) -> "Footage":
        return self

    def __exit__(self, *_exception: object) -> None:
        self.reader.close()


def open_footage(clip: Path, options: FootageOptions) -> Footage:
    """Open a clip with its probe, camera and calibration.

    Raises:
        VideoError: the clip cannot be read.
        ProbeError: no probe was found, or it or the calibration cannot be used.
        CameraError: the camera cannot be used, is of another picture size, or cannot be estimated.
        CalibrationError: self-calibration was asked for, and the clip does not allow it.
    """
    reader = VideoReader(clip)
    try:
        probe_path, camera_path = _paths(clip, options)
        probe = load_probe(probe_path)
        camera, notes = _camera(reader, camera_path, probe)
        calibration = calibration_of(clip, options, probe, camera)
        if calibration.note is not None:
            notes = (*notes, calibration.note)
        camera = camera.with_more_vignetting(calibration.vignetting)
        return Footage(
            reader, probe, camera, probe_path, camera_path, calibration.path,
            calibration.assembly, calibration.fixed, notes,
        )  # fmt: skip
    except BaseException:
        reader.close()
        raise


def sheet_and_camera(clip: Path, options: SheetAndCamera) -> tuple[Probe, Camera, tuple[str, ...]]:
    """The sheet and the camera of a clip, and what to tell the user about them; raises as `open_footage`."""
    probe_path, camera_path = _paths(clip, options)
    probe = load_probe(probe_path)
    with VideoReader(clip) as reader:
        return probe, *_camera(reader, camera_path, probe)


def _paths(clip: Path, options: SheetAndCamera) -> tuple[Path, Path | None]:
    """Where the probe is, and the camera if there is one."""
    probe = options.probe or find_sidecar(clip, "probe")
    if probe is None:
        raise ProbeError(f"{clip}: no probe.json beside it; give the one that `arlight probe` wrote: --probe FILE")
    return probe, options.camera or find_sidecar(clip, "camera")


def _camera(reader: VideoReader, path: Path | None, probe: Probe) -> tuple[Camera, tuple[str, ...]]:
    """The camera that filmed a clip, estimated where there is no file of it, and what to tell about it."""
    if path is None:
        # here, because few clips lack their camera and its calibration takes long to load
        from arlight.calibration.camera.focal_length import estimate_camera

        try:
            estimate = estimate_camera(reader, probe)
        except CalibrationError as error:
            raise CalibrationError(f"{reader.path}: {error}") from error
        return estimate.camera, (f"{reader.path}: {estimate.summary}",)
    camera = Camera.load(path)
    if camera.image_size != reader.size:
        raise CameraError(
            f"{path}: is for pictures of {_size(camera.image_size)}, {reader.path} has {_size(reader.size)}; give "
            "the camera.json of this footage (--camera FILE)"
        )
    return camera, ()


def check_result(footage: Footage, statistics: RunStatistics) -> None:
    """Refuse a run that cannot be right.

    Raises:
        VideoError: the clip is damaged, or no frame showed the sheet.
        ProbeError: the sheet in the clip is another one.
    """
    if not statistics.tracked:
        raise _absence(footage)
    if not shows_the_sheet(statistics):
        raise _mismatch(footage, statistics.median_unexplained)
    if footage.reader.damage is not None:
        raise VideoError(
            f"{footage.reader.path}: {footage.reader.damage}; the frames that can be read were used: "
            "copy or convert it again for the rest"
        )


def shows_the_sheet(statistics: RunStatistics) -> bool:
    """Whether the probe's sheet was seen: its markers, and stripes that some light explains where any are resolved."""
    return statistics.tracked > 0 and not statistics.median_unexplained > _UNEXPLAINED_LIMIT


def _mismatch(footage: Footage, unexplained: float) -> ProbeError:
    return ProbeError(
        f"{footage.probe_path}: does not match the footage: {footage.reader.path} shows its markers, but stripes "
        f"between them that no light explains ({100.0 * unexplained:.0f} % of a typical block's are left over, up to "
        f"{100.0 * _UNEXPLAINED_LIMIT:.0f} % can be); give the probe.json of the sheet that was filmed (--probe FILE), "
        "check its glass_mm and refractive_index and that film and paper lie as the guide has them, or have the sheet "
        "calibrated as it lies (--self-calibrate); a video that is compressed until its stripes are torn looks the same"
    )


def _absence(footage: Footage) -> ArlightError:
    """Why the sheet was seen in no frame, and what to do: looks for other sheets' markers in the clip."""
    clip, probe_path = footage.reader.path, footage.probe_path
    found = recognise_markers(_spread_pictures(footage.reader))
    own = {marker.id for marker in footage.probe.markers}
    for dictionary, ids in found.items():
        if own & set(ids) and same_family(dictionary, footage.probe.dictionary):
            return ProbeError(
                f"{clip}: markers {ids_text(ids)} of {dictionary} are in the picture, but not where {probe_path} "
                "has them; give the probe.json of the sheet that was filmed (--probe FILE), and check camera.json"
            )
    if found:
        seen = "; ".join(f"{dictionary} {ids_text(ids)}" for dictionary, ids in found.items())
        return ProbeError(
            f"{probe_path}: does not match the footage: the probe has the markers {markers_of(footage.probe)}, {clip} "
            f"shows {seen}; give the probe.json of the sheet that was filmed (--probe FILE)"
        )
    return VideoError(
        f"{clip}: no frame showed the sheet of {probe_path} (markers {markers_of(footage.probe)}); film it so that the "
        "markers on its frame are sharp, evenly lit and at least 15 pixels wide"
    )


def _spread_pictures(reader: VideoReader) -> Iterator[NDArray[np.uint8]]:
    stride = max(1, (reader.frame_count or 1) // _SEARCHED)
    for frame in reader:
        if frame.index % stride == 0:
            yield frame.luma()
        if frame.index >= stride * _SEARCHED:
            return


def _size(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"
