"""Clips on disk: what is written is read back, clips share a sheet, nothing is overwritten."""

from fractions import Fraction

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.errors import EnvironmentMapError, OutputError
from arlight.probe.layout import design_probe
from arlight.probe.storage import load_probe
from arlight.synthetic.clip import write_clip
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.truth import load_truth
from arlight.video.reader import VideoReader
from arlight.video.sidecars import find_sidecar
from arlight.video.writer import encoded_format

PROBE = design_probe(order=1, pixels_per_mm=8.0)
SETTINGS = SynthesisSettings(
    environment="apartment",
    path="still",
    camera=default_camera((320, 180)),
    sheet_width_px=160.0,
    duration_s=0.12,
    frame_rate=Fraction(25),
    bounces=0,
)


@pytest.mark.usefixtures("needs_opengl")
def test_clip_is_complete_and_readable(tmp_path):
    seen = []
    truth = write_clip(tmp_path / "new", "a", SETTINGS, PROBE, preset="ultrafast", watch=seen.append)
    with VideoReader(tmp_path / "new" / "a.mp4") as reader:
        frames = list(reader)
        assert reader.frame_rate == 25
    assert len(frames) == len(seen) == len(truth.frames) == 3
    assert [f.time_s for f in frames] == pytest.approx([t.time_s for t in truth.frames], abs=1e-4)
    # the tags say how it was converted
    assert frames[0].format == encoded_format(seen[0].frame)
    assert (frames[0].format.transfer, frames[0].format.full_range) == ("srgb", False)
    # compression and 4:2:0 chroma, not another curve or matrix
    np.testing.assert_allclose(frames[2].linear_rgb(), seen[2].frame.linear_rgb(), atol=0.25)
    assert np.mean(frames[2].linear_rgb()) == pytest.approx(np.mean(seen[2].frame.linear_rgb()), rel=0.01)
    assert load_probe(find_sidecar(tmp_path / "new" / "a.mp4", "probe")) == PROBE
    assert Camera.load(tmp_path / "new" / "camera.json").image_size == (320, 180)
    assert len(load_truth(tmp_path / "new" / "a.truth.json").frames) == 3


@pytest.mark.usefixtures("needs_opengl")
def test_clips_share_a_sheet_and_keep_another_apart(tmp_path):
    other = design_probe(order=1, pixels_per_mm=10.0)
    for name, probe in (("a", PROBE), ("b", PROBE), ("c", other)):
        write_clip(tmp_path, name, SETTINGS, probe, preset="ultrafast")
    assert sorted(path.name for path in tmp_path.glob("*probe.json")) == ["c.probe.json", "probe.json"]
    assert [path.name for path in tmp_path.glob("*camera.json")] == ["camera.json"]
    assert load_probe(find_sidecar(tmp_path / "b.mp4", "probe")) == PROBE
    assert load_probe(find_sidecar(tmp_path / "c.mp4", "probe")) == other


@pytest.mark.usefixtures("needs_opengl")
def test_truth_of_what_was_filmed_survives_an_interruption(tmp_path):
    def stop(synthetic):
        if synthetic.frame.index == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_clip(tmp_path, "a", SETTINGS, PROBE, preset="ultrafast", watch=stop)
    assert len(load_truth(tmp_path / "a.truth.json").frames) == 2
    with VideoReader(tmp_path / "a.mp4") as reader:
        assert len(list(reader)) == 2


@pytest.mark.parametrize("there", ["a.mp4", "a.truth.json", "a.probe.json"])
def test_nothing_is_overwritten(tmp_path, there):
    (tmp_path / there).write_text("mine")
    with pytest.raises(OutputError, match="is there already"):
        write_clip(tmp_path, "a", SETTINGS, PROBE)
    assert (tmp_path / there).read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 1


def test_missing_environment_leaves_nothing_behind(tmp_path):
    with pytest.raises(EnvironmentMapError):
        write_clip(tmp_path, "a", SynthesisSettings(environment="nowhere.hdr"), PROBE)
    assert list(tmp_path.iterdir()) == []


def test_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="file"):
        write_clip(tmp_path / "file", "a", SETTINGS, PROBE)
