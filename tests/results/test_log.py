"""The lighting log: what is written is read back, however the writer ended."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.errors import OutputError
from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies
from arlight.lighting_tracker import FrameEstimate
from arlight.optics import Slab
from arlight.results.log import LightingLogWriter, LogError, read_log
from arlight.results.record import LogHeader, LogRecord
from arlight.tracking.pose import ProbePose

ORDER = 2
FREQUENCIES = half_plane_frequencies(ORDER)


@pytest.fixture
def header() -> LogHeader:
    camera = Camera((320, 240), [[300.0, 0, 159.5], [0, 301.0, 119.5], [0, 0, 1]], [0.1, -0.02, 0.001, 0.002, 0.0])
    return LogHeader(FREQUENCIES, camera, Slab(2.0, 1.5), (120.0, 90.0), "clip.mp4", "probe.json")


def estimate_of(index: int, rng: np.random.Generator) -> FrameEstimate:
    k = len(FREQUENCIES)
    spread = rng.normal(size=(3, 2 * k - 1, 2 * k - 1))
    lighting = Lighting(
        frequencies=FREQUENCIES,
        coefficients=rng.normal(size=(k, 3)) + 1j * rng.normal(size=(k, 3)),
        covariance=spread @ spread.transpose(0, 2, 1),
        time_s=index / 30,
        chi2=rng.uniform(0.5, 2.0),
    )
    pose = ProbePose(Pose.from_rvec(rng.normal(size=3), rng.normal(size=3) * 300), rng.uniform(0, 0.2), "tracked")
    share = rng.uniform(0.0, 0.1)
    return FrameEstimate(index, index / 30, pose, lighting, lighting, timings_s={"track": 0.001}, unexplained=share)


def write_log(path, header, count=3):
    rng = np.random.default_rng(4)
    records = [LogRecord.of(e, e.timings_s | {"render": 0.002}) for e in (estimate_of(i, rng) for i in range(count))]
    with LightingLogWriter(path, header) as writer:
        for record in records:
            writer.write(record)
    return records


def test_what_is_written_is_read_back(tmp_path, header):
    path = tmp_path / "log.jsonl"
    written = write_log(path, header)
    log = read_log(path)
    assert not log.truncated
    assert log.header.slab == header.slab
    assert log.header.sheet_mm == header.sheet_mm
    assert log.header.source == "clip.mp4"
    np.testing.assert_array_equal(log.header.frequencies, FREQUENCIES)
    np.testing.assert_array_equal(log.header.camera.distortion, header.camera.distortion)
    for found, expected in zip(log.records, written, strict=True):
        assert (found.frame, found.status, found.order) == (expected.frame, "tracked", ORDER)
        np.testing.assert_allclose(found.coefficients, expected.coefficients, rtol=1e-7)
        np.testing.assert_allclose(found.stddev, expected.stddev, rtol=1e-7)
        np.testing.assert_allclose(found.pose.rotation, expected.pose.rotation, atol=1e-7)
        np.testing.assert_allclose(found.pose.translation, expected.pose.translation, rtol=1e-7)
        assert found.chi2 == pytest.approx(expected.chi2, rel=1e-7)
        assert found.unexplained == pytest.approx(expected.unexplained, rel=1e-7)
        assert found.timings_ms == pytest.approx({"track": 1.0, "render": 2.0})


def test_unknown_values_are_null_never_nan(tmp_path, header):
    path = tmp_path / "log.jsonl"
    lost = FrameEstimate(0, 0.0, ProbePose.lost(), None, None, timings_s={"track": math.nan})
    with LightingLogWriter(path, header) as writer:
        writer.write(LogRecord.of(lost, lost.timings_s))
    line = path.read_text().splitlines()[1]
    content = json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} in the log"))
    for key in (
        "rvec",
        "tvec",
        "reprojection_rms_px",
        "coefficients_re",
        "coefficients_im",
        "stddev",
        "chi2",
        "order",
        "unexplained",
    ):
        assert content[key] is None, key
    assert content["status"] == "lost"
    record = read_log(path).records[0]
    assert record.pose is None
    assert record.coefficients is None
    assert math.isnan(record.chi2)


def test_every_line_is_on_disk_before_the_next_frame(tmp_path, header):
    path = tmp_path / "log.jsonl"
    rng = np.random.default_rng(1)
    with LightingLogWriter(path, header) as writer:
        for index in range(3):
            estimate = estimate_of(index, rng)
            writer.write(LogRecord.of(estimate, estimate.timings_s))
            assert len(read_log(path).records) == index + 1


@pytest.mark.parametrize("share", [0.02, 0.5, 0.98])
def test_a_cut_last_line_is_left_out(tmp_path, header, share):
    path = tmp_path / "log.jsonl"
    write_log(path, header)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-1]) + lines[-1][: int(share * len(lines[-1]))])
    log = read_log(path)
    assert log.truncated
    assert [record.frame for record in log.records] == [0, 1]


def test_a_damaged_line_before_the_last_is_named(tmp_path, header):
    path = tmp_path / "log.jsonl"
    write_log(path, header)
    lines = path.read_text().splitlines()
    lines[2] = lines[2][:40]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(LogError, match=r"log\.jsonl, line 3"):
        read_log(path)


@pytest.mark.parametrize("text", ["", "{}", "not json", '{"format": "other", "version": 1}', "[1, 2]", '"text"'])
def test_what_is_no_log_is_refused(tmp_path, text):
    path = tmp_path / "other.jsonl"
    path.write_text(text)
    with pytest.raises(LogError, match=r"other\.jsonl: not a lighting log"):
        read_log(path)


def test_binary_and_missing_files_are_refused(tmp_path):
    binary = tmp_path / "clip.mp4"
    binary.write_bytes(bytes(range(256)))
    with pytest.raises(LogError, match="not a text file"):
        read_log(binary)
    with pytest.raises(LogError, match="cannot be read"):
        read_log(tmp_path / "missing.jsonl")


def test_a_newer_version_is_refused(tmp_path, header):
    path = tmp_path / "log.jsonl"
    write_log(path, header)
    path.write_text(path.read_text().replace('"version":1', '"version":9', 1))
    with pytest.raises(LogError, match="version 9"):
        read_log(path)


def test_a_log_that_cannot_be_created_is_an_output_error(tmp_path, header):
    with pytest.raises(OutputError, match="cannot be written"):
        LightingLogWriter(tmp_path / "missing" / "log.jsonl", header)


def test_single_unknown_values_are_null_too(tmp_path, header):
    path = tmp_path / "log.jsonl"
    record = LogRecord.of(estimate_of(0, np.random.default_rng(2)), {"track": 0.001})
    coefficients, stddev = record.coefficients.copy(), record.stddev.copy()
    coefficients[1, 2], stddev[0, 0] = complex(math.nan, 1.0), math.inf
    with LightingLogWriter(path, header) as writer:
        writer.write(replace(record, coefficients=coefficients, stddev=stddev, wall_ms=12.5))
    content = json.loads(path.read_text().splitlines()[1])
    assert content["coefficients_re"][1][2] is content["stddev"][0][0] is None
    assert content["coefficients_im"][1][2] == 1.0
    found = read_log(path).records[0]
    assert math.isnan(found.coefficients[1, 2].real)
    np.testing.assert_allclose(found.coefficients[0], coefficients[0], rtol=1e-7)
    assert found.wall_ms == 12.5
