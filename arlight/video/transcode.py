"""A clip decoded and encoded again, with nothing between: the least that a loop over its frames can take."""

from pathlib import Path

from arlight.chain import Chain
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader
from arlight.video.writer import VideoWriter


def plain_transcode(clip: Path, output: Path, crf: int, preset: str) -> int:
    """Read every frame of a clip and write it as it is, decoding and encoding in a thread each.

    Args:
        clip: the source.
        output: the copy; replaced if it is there.
        crf: quality of libx264, 0 to 51, lower is better.
        preset: speed of libx264, `ultrafast` to `veryslow`.

    Returns:
        How many frames were written.

    Raises:
        VideoError: the clip cannot be read.
        OutputError: the copy cannot be written.
    """
    count = 0
    with (
        VideoReader(clip) as reader,
        VideoWriter(output, like=reader, crf=crf, preset=preset) as writer,
        Chain[Frame](reader, []) as frames,
    ):
        for frame in frames:
            writer.write(frame)
            count += 1
    return count
