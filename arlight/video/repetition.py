"""A clip made longer by repeating it, packet by packet, without decoding anything."""

from fractions import Fraction
from math import ceil
from pathlib import Path

import av
import av.error

from arlight.errors import OutputError, VideoError


def repeat_clip(source: Path, target: Path, duration_s: float) -> int:
    """Write the picture of a clip again and again until the result is long enough.

    Args:
        source: a clip whose frames are stored in order of presentation, such as `VideoWriter` writes.
        target: the longer clip, in a container that holds the source's codec; replaced if it is there.
        duration_s: length to reach [s].

    Returns:
        How many packets, that is frames, were written.

    Raises:
        VideoError: the source cannot be read, or holds nothing.
        OutputError: the target cannot be written.
    """
    try:
        with av.open(str(source)) as read:
            stream = read.streams.video[0]
            packets = [
                (packet.pts, packet.duration or 0, bytes(packet), packet.is_keyframe)
                for packet in read.demux(stream)
                if packet.pts is not None
            ]
            if not packets:
                raise VideoError(f"{source}: holds no frames; record it again")
            return _write(stream, packets, target, duration_s)
    except (av.error.FFmpegError, OSError) as error:
        if getattr(error, "filename", None) == str(target):
            raise OutputError(f"{target}: cannot be written ({error.strerror}); choose another file") from error
        raise VideoError(f"{source}: cannot be repeated into {target} ({error.strerror})") from error


def _write(
    stream: av.video.stream.VideoStream, packets: list[tuple[int, int, bytes, bool]], target: Path, duration_s: float
) -> int:
    first = packets[0][0]
    span = packets[-1][0] + packets[-1][1] - first
    base = stream.time_base or Fraction(1)
    repeats = max(1, ceil(duration_s / float(span * base)))
    written = 0
    with av.open(str(target), "w") as container:
        copy = container.add_stream_from_template(stream)
        for start in range(0, repeats * span, span):
            for pts, duration, data, key in packets:
                packet = av.Packet(data)
                packet.pts = packet.dts = start + pts - first
                packet.duration, packet.time_base, packet.is_keyframe = duration, base, key
                packet.stream = copy
                container.mux_one(packet)
                written += 1
    return written
