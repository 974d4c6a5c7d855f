"""Sound carried from one container to another, packet by packet, without decoding it."""

from collections.abc import Iterator
from pathlib import Path

import av
import av.error
from av.container import InputContainer, OutputContainer
from av.packet import Packet

from arlight.errors import OutputError


class AudioCopy:
    """The sound of a source, handed out in step with the picture."""

    def __init__(self, source: Path, output: OutputContainer, output_path: Path) -> None:
        """Adds the source's audio streams to an output whose header is not written yet.

        Raises:
            OutputError: the output's container cannot hold the source's sound.
        """
        self._container: InputContainer = av.open(str(source))
        self._output = output
        self._pending: Packet | None = None
        streams = self._container.streams.audio
        try:
            self._targets = {s.index: output.add_stream_from_template(s) for s in streams}
        except (ValueError, av.error.FFmpegError) as error:
            self._container.close()
            codecs = ", ".join(sorted({s.codec_context.name for s in streams}))
            raise OutputError(
                f"{output_path}: a {output_path.suffix} file cannot hold the sound of {source} ({codecs}); "
                "name an output that ends in .mkv"
            ) from error
        self._packets: Iterator[Packet] = self._container.demux(*streams) if streams else iter(())

    def write_until(self, time_s: float) -> None:
        """Copies the packets that begin before a time; a damaged source simply ends there."""
        while (packet := self._pending or self._next()) is not None:
            self._pending = packet
            start = packet.pts if packet.pts is not None else packet.dts
            if start is not None and start * packet.time_base >= time_s:
                return
            self._pending = None
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
