"""What is shipped is complete, and its truths say the same in fewer words."""

import json
from pathlib import Path

import numpy as np
import pytest

from arlight.errors import OutputError
from arlight.synthetic.truth import load_truth
from arlight.validation.proof_lights import KNOWN_LIGHTS
from arlight.validation.shipped import ship

TRUTH = Path(__file__).parents[2] / "demo_videos"


@pytest.fixture
def traced(tmp_path):
    """A folder as the suite leaves it; orbit's light is still, turn's is not."""
    folder = tmp_path / "traced"
    (folder / "lights").mkdir(parents=True)
    for name in ("probe", "camera", "assembly"):
        (folder / f"{name}.json").write_text("{}")
    for light in KNOWN_LIGHTS:
        (folder / "lights" / f"{light}.hdr").write_bytes(b"light")
    for clip, source in [("one", "orbit"), ("two", "turn")] + [(f"known-{light}", "orbit") for light in KNOWN_LIGHTS]:
        (folder / f"{clip}.mp4").write_bytes(b"film")
        content = json.loads((TRUTH / f"{source}.truth.json").read_text())
        content["frames"] = content["frames"][:3]
        (folder / f"{clip}.truth.json").write_text(json.dumps(content))
    return folder


@pytest.mark.parametrize(("clip", "smaller"), [("one", True), ("two", False)])
def test_truths_stay_true(traced, tmp_path, clip, smaller):
    target = tmp_path / "data"
    ship(traced, target, ["one", "two"])
    before, after = (load_truth(folder / f"{clip}.truth.json") for folder in (traced, target))
    for old, new in zip(before.frames, after.frames, strict=True):
        np.testing.assert_array_equal(old.coefficients, new.coefficients)
        np.testing.assert_array_equal(old.pose.rotation, new.pose.rotation)
        assert old.exposure == new.exposure
    sizes = [(folder / f"{clip}.truth.json").stat().st_size for folder in (traced, target)]
    assert (sizes[1] < 0.6 * sizes[0]) == smaller


def test_everything_that_is_listed_is_there(traced, tmp_path):
    target = tmp_path / "data"
    written = ship(traced, target, ["one"])
    assert {path.relative_to(target).as_posix() for path in written} == {
        path.relative_to(target).as_posix() for path in target.rglob("*") if path.is_file()
    }
    assert not (target / "two.mp4").exists()


def test_a_missing_clip_is_named(traced, tmp_path):
    with pytest.raises(OutputError, match=r"three\.mp4"):
        ship(traced, tmp_path / "data", ["three"])
