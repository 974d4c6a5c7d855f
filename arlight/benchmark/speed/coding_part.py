"""What decoding and encoding cost, beside OpenCV doing the like."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from time import process_time

import cv2

from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.spread import paired_ratio, spread
from arlight.benchmark.speed.workloads import FRAME_RATE
from arlight.presets import EncodingSettings
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader
from arlight.video.writer import VideoWriter

OPENCV_READING = "OpenCV reading the clip"
OPENCV_WRITING = "OpenCV writing MPEG-4"


def measure_coding(clip: FilmedClip, repeats: int, encoding: EncodingSettings, folder: Path) -> Findings:
    """CPU time a frame of reading a clip and of writing its frames again, whole passes in turns with OpenCV's.

    Args:
        clip: the workload.
        repeats: how often each pass is made, after one that is not counted.
        encoding: how the frames are written.
        folder: for what is written.
    """
    pictures = _pictures(clip.path)
    passes: dict[str, Callable[[], None]] = {
        "decode": lambda: _decode(clip.path),
        OPENCV_READING: lambda: _decode_by_opencv(clip.path),
        "encode": lambda: _encode(clip.frames, encoding, folder / "written.mp4"),
        OPENCV_WRITING: lambda: _encode_by_opencv(pictures, folder / "opencv.mp4"),
    }
    seconds: dict[str, list[float]] = {name: [] for name in passes}
    for repeat in range(repeats + 1):
        for name, work in passes.items():
            begun = process_time()
            work()
            if repeat:
                seconds[name].append((process_time() - begun) / len(clip.frames))
    found = Findings()
    for stage, yardstick in (("decode", OPENCV_READING), ("encode", OPENCV_WRITING)):
        found.ratios[f"{stage}, {clip.workload.name}"] = Ratio(
            paired_ratio(seconds[stage], seconds[yardstick]), yardstick, 1e3 * spread(seconds[stage]).median
        )
    found.details["coding"] = [
        {"name": clip.workload.name, "cpu_ms": {name: asdict(spread(s).scaled(1e3)) for name, s in seconds.items()}}
    ]
    return found


def _decode(path: Path) -> None:
    with VideoReader(path) as reader:
        for _frame in reader:
            pass


def _decode_by_opencv(path: Path) -> None:
    capture = cv2.VideoCapture(str(path))
    while capture.read()[0]:
        pass
    capture.release()


def _encode(frames: Sequence[Frame], encoding: EncodingSettings, path: Path) -> None:
    with VideoWriter(path, frame_rate=FRAME_RATE, crf=encoding.crf, preset=encoding.encoder_preset) as writer:
        for frame in frames:
            writer.write(frame)


def _encode_by_opencv(pictures: Sequence[cv2.typing.MatLike], path: Path) -> None:
    height, width = pictures[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), float(FRAME_RATE), (width, height))
    for picture in pictures:
        writer.write(picture)
    writer.release()


def _pictures(path: Path) -> list[cv2.typing.MatLike]:
    """(h, w, 3) BGR pictures, as OpenCV has them."""
    capture, pictures = cv2.VideoCapture(str(path)), []
    while True:
        read, picture = capture.read()
        if not read:
            break
        pictures.append(picture)
    capture.release()
    return pictures
