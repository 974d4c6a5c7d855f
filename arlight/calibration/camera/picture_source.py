"""Pictures and videos in one stream of frames, for calibrations that need views and not time."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from arlight.calibration.ball.photographs import read_picture
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader

PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
FRAMES_PER_VIDEO = 60


def named_frames(paths: Sequence[Path], per_video: int = FRAMES_PER_VIDEO) -> Iterator[tuple[str, Frame]]:
    """Every picture, and frames spread over every video, each with a name for messages.

    Args:
        paths: pictures (by their ending) and videos, in any order.
        per_video: about how many frames of a video are wanted, where it says how many it has.

    Raises:
        VideoError: a video cannot be read.
        PhotographError: a picture cannot be read.
    """
    for path in paths:
        if path.suffix.lower() in PICTURE_ENDINGS:
            codes, _ = read_picture(path)
            yield str(path), Frame.from_rgb(codes)
            continue
        with VideoReader(path) as reader:
            stride = max(1, (reader.frame_count or per_video) // per_video)
            for frame in reader:
                if frame.index % stride == 0:
                    yield f"{path}, frame {frame.index}", frame
