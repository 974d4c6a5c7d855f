"""Truth files: what is written is read back, files with one light for all frames too, broken ones are refused."""

import json

import numpy as np
import pytest

from arlight.camera import Pose
from arlight.errors import OutputError
from arlight.fourier import half_plane_frequencies
from arlight.synthetic.truth import ClipTruth, FrameTruth, TruthError, load_truth, save_truth


def clip_truth(frames=3):
    generator = np.random.default_rng(0)
    frequencies = half_plane_frequencies(2)

    def frame(index):
        coefficients = generator.normal(size=(len(frequencies), 3)) + 1j * generator.normal(size=(len(frequencies), 3))
        pose = Pose.from_rvec(generator.normal(size=3), generator.normal(size=3) * 100)
        return FrameTruth(pose, coefficients, 1.5 + index, index / 25)

    return ClipTruth("hall", frequencies, tuple(frame(i) for i in range(frames)))


def test_round_trip(tmp_path):
    truth = clip_truth()
    save_truth(truth, tmp_path / "a.truth.json")
    read = load_truth(tmp_path / "a.truth.json")
    assert read.environment == "hall"
    np.testing.assert_array_equal(read.frequencies, truth.frequencies)
    assert len(read.frames) == 3
    for found, expected in zip(read.frames, truth.frames, strict=True):
        np.testing.assert_allclose(found.coefficients, expected.coefficients, rtol=1e-6)
        np.testing.assert_array_equal(found.pose.rotation, expected.pose.rotation)
        np.testing.assert_array_equal(found.pose.translation, expected.pose.translation)
        assert (found.exposure, found.time_s) == (expected.exposure, expected.time_s)


def test_still_light_may_stand_once_at_the_top(tmp_path):
    truth = clip_truth(2)
    save_truth(truth, tmp_path / "a.truth.json")
    content = json.loads((tmp_path / "a.truth.json").read_text())
    for key in ("coefficients_re", "coefficients_im", "exposure"):
        content[key] = content["frames"][0][key]
        for frame in content["frames"]:
            del frame[key]
    (tmp_path / "b.truth.json").write_text(json.dumps(content))
    read = load_truth(tmp_path / "b.truth.json")
    for frame in read.frames:
        np.testing.assert_allclose(frame.coefficients, truth.frames[0].coefficients, rtol=1e-6)
        assert frame.exposure == 1.5


def test_missing_file_is_named(tmp_path):
    with pytest.raises(TruthError, match=r"nowhere\.truth\.json"):
        load_truth(tmp_path / "nowhere.truth.json")


@pytest.mark.parametrize(
    "damage",
    [
        lambda c: c.pop("frequencies"),
        lambda c: c.update(version=9),
        lambda c: c["frames"][1].pop("exposure"),
        lambda c: c["frames"][0].update(coefficients_re=[[1, 2, 3]]),
        lambda c: c["frames"][0].update(camera_from_probe_rotation=[1, 2, 3]),
        lambda c: c.update(frames=7),
    ],
)
def test_damaged_files_are_refused(tmp_path, damage):
    path = tmp_path / "a.truth.json"
    save_truth(clip_truth(), path)
    content = json.loads(path.read_text())
    damage(content)
    path.write_text(json.dumps(content))
    with pytest.raises(TruthError, match=r"a\.truth\.json"):
        load_truth(path)


@pytest.mark.parametrize("text", ["", "[1, 2]", '"arlight"', "{"])
def test_other_files_are_refused(tmp_path, text):
    path = tmp_path / "a.truth.json"
    path.write_text(text)
    with pytest.raises(TruthError, match="not a truth file"):
        load_truth(path)


def test_folder_that_does_not_exist(tmp_path):
    with pytest.raises(OutputError, match="no folder"):
        save_truth(clip_truth(), tmp_path / "no folder" / "a.truth.json")
