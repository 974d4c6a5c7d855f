from pathlib import Path

import pytest

from arlight.errors import OutputError
from arlight.video.audio import check_audio


@pytest.mark.parametrize(
    ("ending", "codec", "held"),
    [
        (".mp4", "aac", True), (".mp4", "opus", True), (".mp4", "pcm_s16le", False), (".MOV", "pcm_s16le", True),
        (".mov", "opus", False), (".mkv", "wmav2", True), (".m4v", "vorbis", False),
    ],
)  # fmt: skip
def test_sound_that_a_container_cannot_hold_is_refused(ending, codec, held):
    output, source = Path(f"out{ending}"), Path("in.avi")
    if held:
        check_audio(output, source, ["aac", codec] if ending != ".mkv" else [codec])
    else:
        with pytest.raises(OutputError, match=rf"in\.avi \({codec}\).*\.mkv"):
            check_audio(output, source, ["aac", codec])
    check_audio(output, source, [])
