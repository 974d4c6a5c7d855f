"""Sound carried from one container to another, packet by packet, without decoding it."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import av
import av.error
from av.container import InputContainer, OutputContainer
from av.packet import Packet

from arlight.errors import OutputError

MPEG4_CODECS = frozenset({"aac", "mp3", "ac3", "eac3", "opus", "flac", "alac"})
"""Sound that an MPEG-4 file holds and players find there."""
QUICKTIME_CODECS = frozenset({"aac", "mp3", "ac3", "eac3", "alac", "pcm_s16le", "pcm_s16be", "pcm_s24le", "pcm_f32le"})
"""Sound that a QuickTime file holds."""


def check_audio(output: Path, source: Path, codecs: Sequence[str]) -> None:
    """Refuses an output whose container cannot hold the source's sound.

    Raises:
        OutputError: which sound, and what to do.
    """
    held = {".mp4": MPEG4_CODECS, ".m4v": MPEG4_CODECS, ".mov": QUICKTIME_CODECS}.get(output.suffix.lower())
    missing = [codec for codec in codecs if held is not None and codec not in held]
    if missing:
        raise OutputError(
            f"{output}: a {output.suffix} file cannot hold the sound of {source} ({', '.join(missing)}); "
            "name an output that ends in .mkv"
        )


class AudioCopy:
    """The sound of a source, handed out in step with the picture."""

    def __init__(self, source: Path, output: OutputContainer, output_path: Path) -> None:
        """Adds the source's audio streams to an output whose header is not written yet."""
        self._container: InputContainer = av.open(str(source))
        self._output = output
        self._pending: Packet | None = None
        # Matroska has no negative times and would shift the picture too; what lies there is the encoder's run-in
        self._earliest_s = 0.0 if output_path.suffix.lower() == ".mkv" else float("-inf")
        streams = self._container.streams.audio
        self._targets = {stream.index: output.add_stream_from_template(stream) for stream in streams}
        self._packets: Iterator[Packet] = self._container.demux(*streams) if streams else iter(())

    def write_until(self, time_s: float) -> None:
        """Copies the packets that begin before a time; a damaged source simply ends there."""
        while (packet := self._pending or self._next()) is not None:
            self._pending = packet
            start = packet.pts if packet.pts is not None else packet.dts
            if start is not None and start * packet.time_base >= time_s:
                return
            self._pending = None
            if start is not None and start * packet.time_base < self._earliest_s:
                continue
            packet.stream = self._targets[packet.stream_index]
            self._output.mux_one(packet)

    def close(self) -> None:
        """Closes the source."""
        self._container.close()

    def _next(self) -> Packet | None:
        try:
            # the packet without data that ends a stream carries no sound
            return next((p for p in self._packets if p.dts is not None), None)
        except av.error.FFmpegError:
            return None
