"""Outputs are checked before any work and replace nothing until there is something better."""

import os
from pathlib import Path

import pytest

from arlight.commands.outputs import partial_path, prepare_outputs
from arlight.errors import OutputError


def test_a_new_file_grows_under_its_own_name(tmp_path):
    output = prepare_outputs({"--output": tmp_path / "new.mp4"}, [])["--output"]
    assert output.growing == output.path
    output.growing.write_text("new")
    output.keep()
    assert output.path.read_text() == "new"
    output.discard()
    assert list(tmp_path.iterdir()) == []


def test_an_existing_file_stands_until_the_new_one_is_kept(tmp_path):
    path = tmp_path / "old.mp4"
    path.write_text("old")
    output = prepare_outputs({"--output": path}, [])["--output"]
    assert output.growing == tmp_path / "old.partial.mp4"
    output.growing.write_text("new")
    assert path.read_text() == "old"
    output.keep()
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_an_existing_file_survives_what_is_discarded(tmp_path):
    path = tmp_path / "old.mp4"
    path.write_text("old")
    output = prepare_outputs({"--output": path}, [])["--output"]
    output.growing.write_text("new")
    output.discard()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_was_not_asked_for_is_left_out(tmp_path):
    assert list(prepare_outputs({"--output": None, "--report": tmp_path / "r.html"}, [None])) == ["--report"]


@pytest.mark.parametrize("alias", ["same", "relative", "symlink", "hardlink"])
def test_an_output_that_is_an_input_is_refused(tmp_path, monkeypatch, alias):
    clip = tmp_path / "clip.mp4"
    clip.write_text("clip")
    output = clip
    if alias == "relative":
        monkeypatch.chdir(tmp_path)
        output = Path("clip.mp4")
    if alias == "symlink":
        output = tmp_path / "link.mp4"
        output.symlink_to(clip)
    if alias == "hardlink":
        output = tmp_path / "link.mp4"
        os.link(clip, output)
    with pytest.raises(OutputError, match=r"clip\.mp4: --output would overwrite this input"):
        prepare_outputs({"--output": output}, [clip])
    assert clip.read_text() == "clip"


def test_the_file_that_grows_is_no_input_either(tmp_path):
    old, clip = tmp_path / "a.mp4", tmp_path / "a.partial.mp4"
    old.write_text("old")
    clip.write_text("clip")
    assert partial_path(old) == clip
    with pytest.raises(OutputError, match="would overwrite this input"):
        prepare_outputs({"--output": old}, [clip])


def test_two_outputs_of_one_name_are_refused(tmp_path):
    path = tmp_path / "out"
    with pytest.raises(OutputError, match="--output and --lighting name the same file"):
        prepare_outputs({"--output": path, "--lighting": path}, [])


def test_a_folder_and_a_missing_folder_are_refused(tmp_path):
    with pytest.raises(OutputError, match="is a folder"):
        prepare_outputs({"--output": tmp_path}, [])
    with pytest.raises(OutputError, match=r"no such folder; create it"):
        prepare_outputs({"--output": tmp_path / "none" / "out.mp4"}, [])
    with pytest.raises(OutputError, match="no such folder"):
        prepare_outputs({"--output": tmp_path / "file" / "out.mp4"}, [])


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_protected_files_and_folders_are_refused(tmp_path):
    protected = tmp_path / "old.mp4"
    protected.write_text("old")
    protected.chmod(0o400)
    with pytest.raises(OutputError, match="write-protected"):
        prepare_outputs({"--output": protected}, [])
    folder = tmp_path / "folder"
    folder.mkdir(mode=0o500)
    with pytest.raises(OutputError, match="no permission"):
        prepare_outputs({"--output": folder / "out.mp4"}, [])


def test_a_device_is_refused():
    with pytest.raises(OutputError, match="not a regular file"):
        prepare_outputs({"--output": Path("/dev/null")}, [])
