"""`arlight synthesize`: a clip with its truth, ready to be run and evaluated."""

import json

import numpy as np
import pytest

from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.assembly_storage import save_assembly
from arlight.results.log import read_log
from arlight.synthetic.truth import load_truth
from arlight.video.reader import VideoReader

QUICK = ("--order", 1, "--size", 320, 240, "--sheet-width-px", 230, "--seconds", 0.12)


def test_a_clip_can_be_run_and_evaluated_as_it_is(arlight, tmp_path):
    assert arlight("synthesize", *QUICK, "--output", "clip", "--path", "handheld").status == 0
    names = {path.name for path in (tmp_path / "clip").iterdir()}
    assert names == {"handheld.mp4", "handheld.truth.json", "probe.json", "camera.json"}
    assert arlight("run", "clip/handheld.mp4", "--no-render").status == 0
    assert len(read_log(tmp_path / "handheld.jsonl").records) == 3
    done = arlight("evaluate", "handheld.jsonl", "--truth", "clip/handheld.truth.json", "--json")
    assert done.status == 0
    figures = json.loads(done.output)
    assert figures["tracked_share"] == 1.0
    # three frames of a picture this small: right in kind, not yet in the last per cent
    assert figures["orders"][0]["relative_to_l0"] < 0.3


def test_name_rate_and_light_are_the_users(arlight, tmp_path):
    done = arlight(
        "synthesize", *QUICK, "--name", "on", "--frame-rate", "30000/1001", "--light", "switch",
        "--second-environment", "hall", "--second-yaw-deg", 90, "--output", "clip",
    )  # fmt: skip
    assert done.status == 0, done.errors
    truth = load_truth(tmp_path / "clip" / "on.truth.json")
    assert truth.frames[1].time_s == pytest.approx(1001 / 30000)
    assert truth.frames[-1].coefficients[0, 0].real > 1.5 * truth.frames[0].coefficients[0, 0].real


def test_a_clip_that_is_there_is_not_replaced(arlight, tmp_path):
    (tmp_path / "clip").mkdir()
    (tmp_path / "clip" / "orbit.mp4").write_text("precious")
    done = arlight("synthesize", *QUICK, "--output", "clip")
    assert done.status == 1
    assert "orbit.mp4: is there already" in done.errors
    assert [path.name for path in (tmp_path / "clip").iterdir()] == ["orbit.mp4"]
    assert (tmp_path / "clip" / "orbit.mp4").read_text() == "precious"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--environment", "nowhere"], "nowhere: no such environment"),
        (["--frame-rate", "fast"], "--frame-rate fast: expected"),
        (["--frame-rate", "25/0"], "--frame-rate 25/0: expected"),
        (["--probe", "none.json"], "none.json"),
        (["--camera", "none.json"], "none.json: cannot be read"),
        (["--assembly", "none.json"], "none.json: cannot be read"),
        (["--light", "switch"], "needs a second environment"),
        (["--tilt-deg", "95"], "95"),
        (["--sensor.blur-px", "-1"], "blur_px"),
    ],
)
def test_bad_input_is_refused(arlight, tmp_path, arguments, message):
    done = arlight("synthesize", *QUICK, *arguments, "--output", "clip")
    assert done.status == 1
    assert message in done.errors
    assert not list(tmp_path.glob("clip/*"))


def test_a_sheet_that_is_put_together_wrong_can_be_filmed(arlight, tmp_path):
    save_assembly(Assembly(paper=Print(Registration((0.5, 0.0)))), tmp_path / "sheet.json")
    assert arlight("synthesize", *QUICK, "--output", "right").status == 0
    assert arlight("synthesize", *QUICK, "--output", "wrong", "--assembly", "sheet.json").status == 0
    right, wrong = (next(iter(VideoReader(tmp_path / name / "orbit.mp4"))) for name in ("right", "wrong"))
    changed = np.abs(right.linear_luma() - wrong.linear_luma())
    # the stripes are others, the frame with its markers is the same
    assert changed[100:140, 130:190].mean() > 0.008
    assert np.median(changed) < 0.002
