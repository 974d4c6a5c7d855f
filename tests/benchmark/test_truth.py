"""Truth files, with light that changes and light that is stated once."""

import json

import numpy as np
import pytest

from arlight.benchmark.truth import read_truth
from arlight.results.log import LogError


def content(frames: int = 2) -> dict:
    pose = {"camera_from_probe_rotation": np.eye(3).tolist(), "camera_from_probe_translation_mm": [0.0, 0.0, 400.0]}
    return {
        "format": "arlight-truth",
        "version": 1,
        "environment": "hall",
        "frequencies": [[0, 0], [0, 1]],
        "coefficients_re": [[1, 2, 3], [0.1, 0.2, 0.3]],
        "coefficients_im": [[0, 0, 0], [0.3, 0.2, 0.1]],
        "frames": [{"frame": i, "time_s": i / 30} | pose for i in range(frames)],
    }


def test_light_stated_once_holds_for_every_frame(tmp_path):
    path = tmp_path / "clip.truth.json"
    path.write_text(json.dumps(content()))
    truth = read_truth(path)
    assert set(truth.frames) == {0, 1}
    np.testing.assert_allclose(truth.frames[1].coefficients[1], [0.1 + 0.3j, 0.2 + 0.2j, 0.3 + 0.1j])
    np.testing.assert_allclose(truth.frames[0].pose.translation, [0, 0, 400])


def test_light_of_a_frame_goes_before_light_stated_once(tmp_path):
    path = tmp_path / "clip.truth.json"
    changed = content()
    changed["frames"][1] |= {"coefficients_re": [[5, 5, 5], [0, 0, 0]], "coefficients_im": [[0, 0, 0], [0, 0, 0]]}
    path.write_text(json.dumps(changed))
    truth = read_truth(path)
    assert truth.frames[0].coefficients[0, 0] == 1
    assert truth.frames[1].coefficients[0, 0] == 5


@pytest.mark.parametrize(
    "damage",
    [
        {"format": "arlight-lighting"},
        {"version": 2},
        {"frequencies": [[0, 0]]},
        {"frames": [{"frame": 0}]},
        {"frames": None},
        {"coefficients_re": "none"},
    ],
)
def test_what_is_no_truth_is_refused(tmp_path, damage):
    path = tmp_path / "clip.truth.json"
    path.write_text(json.dumps(content() | damage))
    with pytest.raises(LogError, match=r"clip\.truth\.json: not a truth file"):
        read_truth(path)


def test_a_missing_truth_is_refused(tmp_path):
    with pytest.raises(LogError, match=r"none\.json: cannot be read"):
        read_truth(tmp_path / "none.json")
