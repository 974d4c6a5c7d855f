"""`arlight prove` refuses what it cannot judge, before it works for minutes."""

import shutil
from pathlib import Path

import pytest

from arlight.commands.options.prove import ProveOptions
from arlight.commands.prove import run
from arlight.errors import OutputError, ProbeError, VideoError

TRACED = Path(__file__).parents[1] / "data" / "traced"


def test_a_folder_without_clips_is_refused(tmp_path):
    for name in ("probe.json", "camera.json", "assembly.json"):
        shutil.copy(TRACED / name, tmp_path)
    with pytest.raises(VideoError, match=r"orbit-\*\.mp4 or dive-\*\.mp4.*arlight trace"):
        run(ProveOptions(tmp_path, paths=("orbit", "dive")))


def test_a_folder_without_the_sheet_is_refused(tmp_path):
    with pytest.raises(ProbeError, match=r"probe\.json"):
        run(ProveOptions(tmp_path))


@pytest.mark.parametrize("output", ["no/such/folder.json", "."])
def test_an_output_that_cannot_be_written_is_refused_at_once(tmp_path, output):
    with pytest.raises(OutputError, match="--output"):
        run(ProveOptions(TRACED, output=tmp_path / output))
