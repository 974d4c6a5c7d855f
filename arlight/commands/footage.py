"""A clip with the probe and the camera that belong to it, and what to say when the sheet was never seen."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera
from arlight.commands.options import OptionalFile
from arlight.errors import ArlightError, CameraError, ProbeError, VideoError
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


@dataclass(frozen=True)
class FootageOptions:
    """What was filmed, and with what; found beside the clip where it is not given."""

    probe: OptionalFile = None
    """probe.json of the sheet that was filmed."""
    camera: OptionalFile = None
    """camera.json of the camera that filmed it: image_size, camera_matrix and distortion."""


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
    camera_path: Path
    """Where the camera was read from."""

    def __enter__(self) -> "Footage":
        return self

    def __exit__(self, *_exception: object) -> None:
        self.reader.close()


def open_footage(clip: Path, options: FootageOptions) -> Footage:
    """Open a clip with its probe and camera.

    Raises:
        VideoError: the clip cannot be read.
        ProbeError: no probe was found, or it cannot be used.
        CameraError: no camera was found, it cannot be used, or it is of another picture size.
    """
    reader = VideoReader(clip)
    try:
        probe_path = options.probe or find_sidecar(clip, "probe")
        if probe_path is None:
            raise ProbeError(f"{clip}: no probe.json beside it; give the one that `arlight probe` wrote: --probe FILE")
        camera_path = options.camera or find_sidecar(clip, "camera")
        if camera_path is None:
            raise CameraError(
                f"{clip}: no camera.json beside it; give the intrinsics of the camera that filmed it (image_size, "
                "camera_matrix, distortion as OpenCV's calibration reports them): --camera FILE"
            )
        probe, camera = load_probe(probe_path), Camera.load(camera_path)
        if camera.image_size != reader.size:
            raise CameraError(
                f"{camera_path}: is for pictures of {_size(camera.image_size)}, {clip} has {_size(reader.size)}; give "
                "the camera.json of this footage (--camera FILE)"
            )
        return Footage(reader, probe, camera, probe_path, camera_path)
    except BaseException:
        reader.close()
        raise


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
        "check its glass_mm and refractive_index and that film and paper lie as the guide has them; a video that is "
        "compressed until its stripes are torn looks the same"
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
