"""`arlight evaluate`: the figures as a table and as JSON."""

import json
import re

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.probe.storage import load_probe
from arlight.results.log import LightingLogWriter, read_log
from arlight.results.record import LogHeader, LogRecord
from arlight.synthetic.truth import load_truth


@pytest.fixture
def perfect_log(footage, tmp_path):
    """A log that says what is true, but for order 0, which is 3 % too bright."""
    truth = load_truth(footage / "orbit.truth.json")
    header = LogHeader.of(load_probe(footage / "probe.json"), Camera.load(footage / "camera.json"), "c", "p")
    with LightingLogWriter(tmp_path / "log.jsonl", header) as writer:
        for index, frame in enumerate(truth.frames):
            light = frame.coefficients.copy()
            light[0] *= 1.03
            writer.write(
                LogRecord(index, frame.time_s, "tracked", frame.pose, 0.1, light, np.abs(light), 1, 1.2, {"track": 2.0})
            )
    return tmp_path / "log.jsonl"


def test_the_table_states_each_order_against_order_zero(arlight, footage, perfect_log):
    done = arlight("evaluate", perfect_log, "--truth", footage / "orbit.truth.json")
    assert done.status == 0, done.errors
    rows = [line.replace("│", " ").split() for line in done.output.splitlines()]
    assert ["0", "3.00", "%", "3.0", "%"] in rows
    assert ["1", "0.00", "%", "0.0", "%"] in rows
    assert "100.0 % of the clip's frames" in done.output
    assert "0.000 px rms" in done.output
    assert "track 2.00" in done.output


def test_json_holds_the_same_figures(arlight, footage, perfect_log):
    done = arlight("evaluate", perfect_log, "--truth", footage / "orbit.truth.json", "--json")
    figures = json.loads(done.output)
    assert figures["orders"][0]["relative_to_l0"] == pytest.approx(0.03, rel=1e-6)
    assert figures["step"] is None
    assert figures["chi2"] == pytest.approx(1.2)
    # one real number of the sheet's five is 3 / 103 of its error bar off
    assert figures["normalised_error"] == pytest.approx((0.03 / 1.03) ** 2 / 5, rel=1e-5)


def test_error_bars_are_judged(arlight, footage, perfect_log):
    done = arlight("evaluate", perfect_log, "--truth", footage / "orbit.truth.json")
    assert re.search(r"error over error bar +0\.00 per degree of freedom", done.output)


def test_a_cut_log_is_evaluated_and_the_cut_is_named(arlight, footage, perfect_log):
    perfect_log.write_bytes(perfect_log.read_bytes()[:-30])
    done = arlight("evaluate", perfect_log, "--truth", footage / "orbit.truth.json")
    assert done.status == 0
    assert "log.jsonl: the last line is cut off" in done.output
    count = len(read_log(perfect_log).records)
    assert f"({count} compared)" in done.output


@pytest.mark.parametrize(
    ("log", "truth", "named"),
    [
        ("none.jsonl", "{truth}", "none.jsonl"),
        ("{log}", "none.json", "none.json"),
        ("{truth}", "{truth}", "orbit.truth.json"),
        ("{log}", "{log}", "log.jsonl"),
    ],
)
def test_what_is_neither_log_nor_truth_is_refused(arlight, footage, perfect_log, log, truth, named):
    paths = {"log": perfect_log, "truth": footage / "orbit.truth.json"}
    done = arlight("evaluate", log.format(**paths), "--truth", truth.format(**paths))
    assert done.status == 1
    assert named in done.errors
