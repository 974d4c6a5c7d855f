"""Self-calibration on the first seconds of a clip, with progress; for `arlight calibrate self` and `arlight run`."""

from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn
from threadpoolctl import threadpool_limits

from arlight.calibration.layers.self_calibration import SelfCalibration, self_calibrate
from arlight.calibration.layers.view_measurement import find_sheet
from arlight.camera import Camera
from arlight.commands.options.calibrate_self import FIRST_SECONDS
from arlight.errors import CalibrationError
from arlight.probe.design import Probe
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader

_MOST_FRAMES = 120
"""Frames that are kept at most; of a faster clip every n-th is looked at."""


def self_calibrate_clip(clip: Path, probe: Probe, camera: Camera, seconds: float = FIRST_SECONDS) -> SelfCalibration:
    """Estimate the assembled sheet from the first seconds of a clip.

    Raises:
        CalibrationError: the clip does not tell; the message names it.
        VideoError: it cannot be read.
    """
    with VideoReader(clip) as reader, _progress() as progress, threadpool_limits(limits=1, user_api="blas"):
        task = progress.add_task(f"{clip.name}: finding the sheet", total=None)
        seen = find_sheet(_first(reader, seconds), probe, camera)

        def advance(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total, description=f"{clip.name}: calibrating the sheet")

        try:
            return self_calibrate(seen, probe, camera, advance)
        except CalibrationError as error:
            raise CalibrationError(f"{clip}: {error}") from error


def _first(reader: VideoReader, seconds: float) -> Iterator[Frame]:
    stride = max(1, round(seconds * float(reader.frame_rate or 25) / _MOST_FRAMES))
    for frame in reader:
        if frame.time_s > seconds:
            return
        if frame.index % stride == 0:
            yield frame


def _progress() -> Progress:
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
