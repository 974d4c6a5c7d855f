"""Writes frames as H.264 with their own times and colour tags; what is written is on disk at once."""

import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from os import PathLike
from pathlib import Path
from types import TracebackType

import av
import av.error
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream
from numpy.typing import NDArray

from arlight.errors import OutputError
from arlight.video.audio import AudioCopy, check_audio
from arlight.video.conversion import Planes
from arlight.video.frame import Frame
from arlight.video.pixel_format import CHROMA_LOCATIONS, PixelFormat, chroma_offset_px, colour_format
from arlight.video.reader import VideoReader
from arlight.video.stream_format import tags_of
from arlight.video.threads import encoder_threads

CONTAINERS = (".mp4", ".m4v", ".mov", ".mkv")
"""Endings of the containers that keep H.264 with its own times."""
CONTAINER_OPTIONS: dict[str, dict[str, str]] = {
    # a fragment a frame (the flag for that, unlike this duration of 1 us, spoils the times of sound) until the file is
    # closed, a plain file after; the header waits for the first time stamp
    "mov": {"movflags": "+hybrid_fragmented+delay_moov", "frag_duration": "1"},
    # a cluster a frame
    "matroska": {"cluster_time_limit": "1"},
}
DEFAULT_TIME_BASE = Fraction(1, 90_000)
"""Unit of time of frames that come from no file [s]."""


class VideoWriter:
    """A sink for frames. Nothing is opened, and nothing that was there is replaced, before the first frame.

    The file is readable up to the last frame but one even if the process is killed, and complete when the writer is
    closed, also by Ctrl-C: the encoder runs without delay and every frame is flushed. 4:2:0, 8 bits, or 10 where the
    frames have more; matrix, range, transfer and chroma sites stay the frames' own. An odd width or height, which
    4:2:0 has no room for, is padded to the next even one by repeating the edge. The source's sound is copied as it is.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        like: VideoReader | None = None,
        *,
        frame_rate: Fraction | int | None = None,
        crf: int = 18,
        preset: str = "ultrafast",
        audio: bool = True,
        tune: str = "zerolatency",
    ) -> None:
        """Checks that the output could be written.

        Args:
            path: the output; ends in one of `CONTAINERS`.
            like: the source, whose unit of time, colour tags and sound are kept.
            frame_rate: nominal frames per second, the source's or 30 by default; frames keep their own times.
            crf: quality of libx264, 0 to 51, lower is better.
            preset: speed of libx264, `ultrafast` to `veryslow`.
            audio: copy the source's sound.
            tune: tuning of libx264; `psnr` keeps measured values best, but holds frames back, so that a file that is
                cut off lacks its last second.

        Raises:
            OutputError: the output is the source, is a folder, its folder is missing or not writable, or its container
                cannot hold the source's sound.
        """
        self.path = Path(path)
        """The output."""
        self._like, self._audio_wanted = like, audio
        self._rate = Fraction(frame_rate or (like.frame_rate if like else 30))
        self._time_base = like.time_base if like else DEFAULT_TIME_BASE
        self._frame_s, self._tick_s = float(1 / self._rate), float(self._time_base)
        # no reordered frames: the container loses the last of them
        self._options = {"preset": preset, "crf": str(crf), "tune": tune, "bf": "0"}
        self._container: OutputContainer | None = None
        self._audio: AudioCopy | None = None
        self._failed = False
        self._last_time = -(2**62)
        check_output(self.path, [like.path] if like else [])
        if like and audio:
            check_audio(self.path, like.path, like.audio_codecs)

    def write(self, frame: Frame) -> None:
        """Appends a frame.

        Raises:
            OutputError: the file cannot be written.
            ValueError: the frame's size differs from the first one's.
        """
        try:
            if self._container is None:
                self._open(frame)
            self._write(frame)
        except (av.error.FFmpegError, OSError) as error:
            self._failed = True
            raise OutputError(
                f"{self.path}: cannot be written ({error.strerror}); check the folder, the space on the disk and "
                "whether another program has the file open"
            ) from error

    def close(self) -> None:
        """Completes the file; without a frame there is none."""
        container, self._container = self._container, None
        if container is None:
            return
        try:
            if self._failed:
                # the muxer may be half open: handing it more would crash it, and the error is known already
                with suppress(av.error.FFmpegError, OSError):
                    container.close()
                return
            container.mux(self._stream.encode(None))
            container.close()
        except (av.error.FFmpegError, OSError) as error:
            raise OutputError(
                f"{self.path}: cannot be completed ({error.strerror}); check the space on the disk"
            ) from error
        finally:
            if self._audio:
                self._audio.close()

    def __enter__(self) -> "VideoWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _open(self, frame: Frame) -> None:
        kind = "matroska" if self.path.suffix.lower() == ".mkv" else "mov"
        # interleaving waits for the stream that is behind, at most this long: sound may end before the picture
        options = {"flush_packets": "1", "max_interleave_delta": "100000", **CONTAINER_OPTIONS[kind]}
        muxer = "matroska" if kind == "matroska" else "mov" if self.path.suffix.lower() == ".mov" else "mp4"
        if kind == "mov":
            # or an edit list rounds the first time to a millisecond
            options["movie_timescale"] = str(min(self._time_base.denominator, 10_000_000))
        container = av.open(str(self.path), "w", format=muxer, container_options=options)
        try:
            self._format = encoded_format(frame)
            self._stream = self._video_stream(container, frame)
            # one for all frames: the encoder takes a copy of what it is given
            layout = self._stream.codec_context.pix_fmt or "yuv420p"
            self._picture = av.VideoFrame(self._stream.width, self._stream.height, layout)
            wanted = self._like if self._audio_wanted else None
            self._audio = AudioCopy(wanted.path, container, self.path) if wanted else None
        except BaseException:
            container.close()
            raise
        self._container = container

    def _video_stream(self, container: OutputContainer, frame: Frame) -> VideoStream:
        w, h = self._size = frame.size
        stream = container.add_stream("libx264", rate=self._rate)
        stream.width, stream.height = w + w % 2, h + h % 2
        stream.pix_fmt = "yuv420p" if self._format.bit_depth == 8 else "yuv420p10le"
        context = stream.codec_context
        context.time_base = stream.time_base = self._time_base
        context.thread_count = encoder_threads()
        tags = tags_of(self._format, self._like.tags if self._like else None)
        context.colorspace, context.color_range, context.color_trc, context.color_primaries = tags
        if self._like and self._like.pixel_aspect:
            context.sample_aspect_ratio = self._like.pixel_aspect
        stream.options = {**self._options, "chroma_sample_location": _location(self._format)}
        return stream

    def _write(self, frame: Frame) -> None:
        if frame.size != self._size:
            raise ValueError(f"expected frames of {self._size} pixels like the first one, found {frame.size}")
        picture = self._picture_of(frame.converted(self._format).planes)
        # two frames may not share a time: the container would refuse the second
        ticks = max(round(frame.time_s / self._tick_s), self._last_time + 1)
        picture.pts, picture.time_base, self._last_time = ticks, self._time_base, ticks
        packets = self._stream.encode(picture)
        assert self._container is not None
        if self._audio:
            self._audio.write_until(frame.time_s + self._frame_s)
        self._container.mux(packets)

    def _picture_of(self, planes: Planes) -> av.VideoFrame:
        whole = _in_one_piece(planes)
        if whole is not None:
            return av.VideoFrame.from_numpy_buffer(whole, "yuv420p")
        # a copy only should the encoder still hold the last one
        self._picture.make_writable()
        _fill(self._picture, planes)
        return self._picture


def encoded_format(frame: Frame) -> PixelFormat:
    """The 4:2:0 format a frame is encoded in: its own matrix, range, transfer and, where it has them, chroma sites."""
    colour = colour_format(frame.format, frame.size)
    offset = colour.chroma_offset_px
    if colour.chroma_shift != (1, 1) or offset not in CHROMA_LOCATIONS.values():
        offset = chroma_offset_px("left", (1, 1))
    return replace(colour, bit_depth=8 if colour.bit_depth == 8 else 10, chroma_shift=(1, 1), chroma_offset_px=offset)


def check_output(path: Path, inputs: Sequence[Path]) -> None:
    """Refuses an output that cannot be written or that is one of the inputs.

    Raises:
        OutputError: which it is, and what to do.
    """
    if path.suffix.lower() not in CONTAINERS:
        raise OutputError(f"{path}: expected a name that ends in {', '.join(CONTAINERS)}; rename the output")
    if path.is_dir():
        raise OutputError(f"{path}: is a folder, expected the name of a file in it")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: its folder {path.parent} does not exist; create it first")
    for source in inputs:
        if path.exists() and source.exists() and path.samefile(source):
            raise OutputError(f"{path}: is also the input; name another output")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise OutputError(f"{path}: may not be written; change its permissions or name another output")


def _location(format_: PixelFormat) -> str:
    return next(name for name, place in CHROMA_LOCATIONS.items() if place == format_.chroma_offset_px)


def _in_one_piece(planes: Planes) -> NDArray[np.uint8] | None:
    """Planes of 4:2:0 that lie one after the other, as (3 h / 2, w) codes of their own memory; None for others."""
    memory, (h, w) = planes[0].base, planes[0].shape
    starts = [planes[0].ctypes.data + offset for offset in (0, h * w, 5 * h * w // 4)]
    together = isinstance(memory, np.ndarray) and memory.dtype == np.uint8 and 2 * memory.size == 3 * h * w
    # PyAV tells the height from the rows of all planes together, in fours
    if not together or h % 4 or w % 2 or [plane.ctypes.data for plane in planes] != starts:
        return None
    return np.asarray(memory, np.uint8).reshape(-1, w)


def _fill(picture: av.VideoFrame, planes: Planes) -> None:
    """Put planes into a picture for the encoder, padded to its size by repeating the edge."""
    for target, codes in zip(picture.planes, planes, strict=True):
        memory = np.frombuffer(memoryview(target), codes.dtype).reshape(-1, target.line_size // codes.itemsize)
        h, w = codes.shape
        memory[:h, :w] = codes
        if (w, h) != (target.width, target.height):
            memory[:h, w : target.width] = codes[:, -1:]
            memory[h : target.height, : target.width] = memory[h - 1, : target.width]
