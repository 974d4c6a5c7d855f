"""All files or none, and nothing lost that stood there before."""

import pytest

from arlight.errors import OutputError, ProbeError
from arlight.probe import output
from arlight.probe.layout import design_probe
from arlight.probe.output import write_probe
from arlight.probe.rasters import read_rasters
from arlight.probe.storage import load_probe

NAMES = {
    *("probe.json", "top.png", "bottom.png", "frame.png"),
    *("top.pdf", "bottom.pdf", "frame.pdf", "preview.png", "guide.pdf"),
}


@pytest.fixture(scope="module")
def probe():
    return design_probe(1, "doubled", pixels_per_mm=8.0)


def test_everything_is_written_and_reads_back(probe, tmp_path):
    paths = write_probe(probe, tmp_path / "new" / "probe")
    assert {path.name for path in paths} == NAMES
    assert {path.name for path in (tmp_path / "new" / "probe").iterdir()} == NAMES
    assert load_probe(paths[0]) == probe
    assert read_rasters(probe, paths[0].parent).film.max() == 1.0


def test_same_sheet_gives_same_files(probe, tmp_path):
    first, second = write_probe(probe, tmp_path / "a", "letter"), write_probe(probe, tmp_path / "b", "letter")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_failure_leaves_earlier_files_alone(probe, tmp_path, monkeypatch):
    write_probe(probe, tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full_disk(*_arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(output, "write_guide", full_disk)
    with pytest.raises(OutputError, match="No space left on device"):
        write_probe(design_probe(1, pixels_per_mm=8.0), tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_file_in_the_folders_place_is_refused(probe, tmp_path):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(OutputError, match="taken"):
        write_probe(probe, tmp_path / "taken")
    assert (tmp_path / "taken").read_text() == "mine"


def test_folder_in_a_files_place_is_refused_before_anything_moves(probe, tmp_path):
    (tmp_path / "guide.pdf").mkdir()
    with pytest.raises(OutputError, match=r"guide\.pdf: is a folder"):
        write_probe(probe, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["guide.pdf"]


def test_sheet_that_does_not_fit_writes_nothing(tmp_path):
    with pytest.raises(ProbeError, match="the largest order that fits is 5"):
        write_probe(design_probe(7, pixels_per_mm=8.0), tmp_path / "probe")
    assert not (tmp_path / "probe").exists()
