"""Reads a video frame by frame, with the stream's own times and colour tags."""

import re
from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from os import PathLike
from pathlib import Path
from types import TracebackType

import av
import av.error
import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream

from arlight.errors import VideoError
from arlight.video.conversion import Plane, Planes
from arlight.video.frame import Frame
from arlight.video.orientation import upright
from arlight.video.pixel_format import PixelFormat
from arlight.video.stream_format import ColourTags, chroma_location, colour_tags, pixel_format, planar_name
from arlight.video.threads import decoder_threads

FALLBACK_RATE = Fraction(25)
"""Frames per second of a stream that states neither a rate nor times."""


class VideoReader:
    """A video file as an iterable of frames, upright, in order of presentation; may be iterated once at a time.

    The first frame is decoded when the reader is opened, so what cannot be read is refused there. A file that is
    damaged further on yields the frames that are intact and says in `damage` what is missing. Interlaced video is
    refused.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        """Opens a video and decodes its first frame.

        Raises:
            VideoError: no such file, not a video, no frame that can be decoded, or colour that is not understood.
        """
        self.path = Path(path)
        """The file."""
        self.damage: str | None = None
        """What the last pass over the file could not read, None where it was whole."""
        container = _open(self.path)
        try:
            stream = _picture_stream(container)
            # taken down here: a file that was closed may not be asked
            self.frame_rate: Fraction = stream.average_rate or stream.guessed_rate or FALLBACK_RATE
            """Average frames per second."""
            self.time_base: Fraction = stream.time_base or 1 / self.frame_rate
            """Unit of the stream's times [s]."""
            pictures = self._pictures(container, stream)
            first = self._first_picture(pictures)
            self._describe(container, stream, first)
        except BaseException:
            container.close()
            raise
        # the first pass goes on from here: to open a file takes as long as some frames
        self._begun: tuple[InputContainer, Iterator[av.VideoFrame]] | None = (container, chain([first], pictures))

    @property
    def format(self) -> PixelFormat:
        """What the codes of the frames mean, before they are turned upright."""
        return self._format

    def __iter__(self) -> Iterator[Frame]:
        begun, self._begun = self._begun, None
        if begun is None:
            self.damage = None
            container = _open(self.path)
            begun = container, self._pictures(container, _picture_stream(container))
        # a pass has its file to itself, also when the reader is closed meanwhile
        with begun[0]:
            for index, picture in enumerate(begun[1]):
                yield self._frame(picture, index)

    def __enter__(self) -> "VideoReader":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file; to iterate opens it again."""
        begun, self._begun = self._begun, None
        if begun is not None:
            begun[0].close()

    def _describe(self, container: InputContainer, stream: VideoStream, first: av.VideoFrame) -> None:
        self.frame_count: int | None = _frame_count(stream, self.frame_rate)
        """How many frames the file says it has, an estimate; None where it does not say."""
        self.pixel_aspect: Fraction | None = stream.codec_context.sample_aspect_ratio or None
        """Width of a pixel relative to its height, None where the stream does not say."""
        sounds = container.streams.audio
        self.audio_codecs: list[str] = [sound.codec_context.codec.canonical_name for sound in sounds]
        """The codec of each sound stream."""
        self.tags: ColourTags = colour_tags(first)
        """The stream's colour tags, as they stand in it."""
        self._layout = (first.width, first.height, first.format.name)
        self._format = self._pixel_format(first, stream.codec_context.name)
        self.size: tuple[int, int] = self._frame(first, 0).size
        """Width and height of the upright frames [px]."""

    def _first_picture(self, pictures: Iterator[av.VideoFrame]) -> av.VideoFrame:
        picture = next(pictures, None)
        if picture is None:
            reason = f" ({self.damage})" if self.damage else ""
            raise VideoError(f"{self.path}: no frame can be decoded{reason}; expected at least one: record it again")
        if picture.interlaced_frame:
            raise VideoError(
                f"{self.path}: is interlaced, expected progressive frames: deinterlace it first, for instance with "
                f"ffmpeg -i {self.path.name} -vf bwdif progressive.mp4"
            )
        return picture

    def _pictures(self, container: InputContainer, stream: VideoStream) -> Iterator[av.VideoFrame]:
        """Decoded pictures up to the end or the damage; corrupt ones are left out."""
        broken, decoded, end = 0, 0, 0
        packets = container.demux(stream)
        while True:
            try:
                packet = next(packets, None)
                pictures = [] if packet is None else packet.decode()
            except av.error.InvalidDataError:
                broken += 1
                self.damage = f"{self.path}: damaged pictures left out: {broken}, the last after frame {decoded}"
                continue
            except av.error.FFmpegError as error:
                self.damage = f"{self.path}: cannot be read beyond frame {decoded} ({error.strerror})"
                return
            if packet is None:
                break
            for picture in pictures:
                if picture.is_corrupt:
                    broken += 1
                    self.damage = f"{self.path}: damaged pictures left out: {broken}, the last after frame {decoded}"
                    continue
                decoded += 1
                if picture.pts is not None:
                    end = picture.pts + picture.duration
                yield picture
        expected_s, end_s = _expected_end_s(stream), float(end * self.time_base)
        if decoded and expected_s is not None and end_s + 2.0 / self.frame_rate < expected_s:
            cut = f"ends at {end_s:.2f} s instead of {expected_s:.2f} s, it is cut off"
            self.damage = f"{self.damage}; {cut}" if self.damage else f"{self.path}: {cut}"

    def _pixel_format(self, picture: av.VideoFrame, codec: str) -> PixelFormat:
        name, location = planar_name(picture.format.name), chroma_location(picture)
        try:
            return pixel_format(name, self.tags, location, (picture.width, picture.height), codec)
        except VideoError as error:
            raise VideoError(f"{self.path}: {error}") from error

    def _frame(self, picture: av.VideoFrame, index: int) -> Frame:
        layout = (picture.width, picture.height, picture.format.name)
        if layout != self._layout:
            raise VideoError(
                f"{self.path}: expected pictures of {self._layout} throughout, found {layout} at frame {index}; "
                "cut the video where it changes"
            )
        time_s = float(index / self.frame_rate) if picture.time is None else picture.time
        planes, format_ = upright(planes_of(picture, self._format), self._format, picture.rotation)
        return Frame(index, time_s, planes, format_)


def planes_of(picture: av.VideoFrame, format_: PixelFormat) -> Planes:
    """A picture's components as views (h, w) of its memory, R, G, B or Y, Cb, Cr; alpha is left out."""
    planar = picture.reformat(format=planar_name(picture.format.name))
    size = (planar.width, planar.height)
    sizes = [size, format_.chroma_size(size), format_.chroma_size(size)][: format_.plane_count]
    stored = (2, 0, 1) if format_.matrix == "rgb" else (0, 1, 2)
    planes: list[Plane] = []
    for k, (w, h) in zip(stored, sizes, strict=False):
        plane = planar.planes[k]
        codes = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
        planes.append(codes.view(format_.dtype)[:h, :w])  # type: ignore[arg-type]
    return tuple(planes)


def _open(path: Path) -> InputContainer:
    if not path.is_file():
        raise VideoError(f"{path}: expected a video file, found {'a folder' if path.is_dir() else 'nothing'} there")
    if path.stat().st_size == 0:
        raise VideoError(f"{path}: is empty (0 bytes), expected a video; record or copy it again")
    try:
        container = av.open(str(path))
    except (av.error.FFmpegError, OSError) as error:
        raise VideoError(
            f"{path}: cannot be read as a video ({error.strerror}); it may be cut off or not a video: copy it again or "
            "convert it with ffmpeg"
        ) from error
    if not container.streams.video:
        container.close()
        raise VideoError(f"{path}: has no video stream, expected one; name the clip, not its sound or its data")
    return container


def _picture_stream(container: InputContainer) -> VideoStream:
    """The stream to read, not a cover picture where there is another, ready to be decoded."""
    best = container.streams.best("video")
    stream = best if isinstance(best, VideoStream) else container.streams.video[0]
    stream.thread_type, stream.codec_context.thread_count = "AUTO", decoder_threads()
    return stream


def _frame_count(stream: VideoStream, rate: Fraction) -> int | None:
    if stream.frames:
        return int(stream.frames)
    end = _expected_end_s(stream)
    return round((end - _start_s(stream)) * rate) or None if end is not None else None


def _start_s(stream: VideoStream) -> float:
    return float((stream.start_time or 0) * (stream.time_base or 0))


def _expected_end_s(stream: VideoStream) -> float | None:
    """When the stream says that it ends [s], None where it does not say."""
    if stream.duration and stream.time_base:
        return _start_s(stream) + float(stream.duration * stream.time_base)
    clock = re.fullmatch(r"(\d+):(\d+):(\d+\.?\d*)", stream.metadata.get("DURATION", ""))
    return int(clock[1]) * 3600 + int(clock[2]) * 60 + float(clock[3]) if clock else None
