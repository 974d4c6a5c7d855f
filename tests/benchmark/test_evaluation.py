"""The figures of an evaluation, against errors that were put in."""

import math
from dataclasses import replace

import numpy as np
import pytest

from arlight.benchmark.evaluation import evaluate
from arlight.camera import Camera, Pose
from arlight.fourier import frequency_order, half_plane_frequencies
from arlight.optics import Slab
from arlight.results.log import LightingLog, LogError
from arlight.results.record import LogHeader, LogRecord
from arlight.synthetic.truth import ClipTruth, FrameTruth

FREQUENCIES = half_plane_frequencies(2)
ORDERS = frequency_order(FREQUENCIES)
CAMERA = Camera((640, 480), [[500.0, 0, 320], [0, 500.0, 240], [0, 0, 1]], np.zeros(5))
HEADER = LogHeader(FREQUENCIES, CAMERA, Slab(), (150.0, 150.0), "clip.mp4", "probe.json")
# looking straight down from 400 mm
POSE = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 400.0]))
FRAMES = 20


def true_light() -> np.ndarray:
    light = np.full((len(FREQUENCIES), 3), 0.2 - 0.1j)
    light[0] = [2.0, 1.0, 0.5]
    return light


def record_of(frame: int, coefficients, pose=POSE, status="tracked") -> LogRecord:
    return LogRecord(frame, frame / 30, status, pose, 0.05, coefficients, None, 2, 1.5, {"track": 1.0, "render": 3.0})


def truth_of(frames: int = FRAMES) -> ClipTruth:
    return ClipTruth("hall", FREQUENCIES, tuple(FrameTruth(POSE, true_light(), 1.0, i / 30) for i in range(frames)))


def log_of(records) -> LightingLog:
    return LightingLog(HEADER, tuple(records), truncated=False)


def test_no_error_is_no_error():
    result = evaluate(log_of([record_of(i, true_light()) for i in range(FRAMES)]), truth_of())
    assert result.tracked_share == 1.0
    assert [error.order for error in result.orders] == [0, 1, 2]
    assert all(error.relative_to_l0 == 0.0 for error in result.orders)
    assert result.pose is not None
    assert result.pose.worst_px == pytest.approx(0.0, abs=1e-9)
    assert result.chi2 == 1.5
    assert result.timings_ms == {"track": 1.0, "render": 3.0}
    assert result.step is None
    assert result.lag is None


def test_an_error_in_one_order_is_stated_against_order_zero():
    wrong = true_light()
    wrong[ORDERS == 1] += 0.03 + 0.04j  # 0.05 in modulus, every coefficient and channel
    result = evaluate(log_of([record_of(i, wrong) for i in range(FRAMES)]), truth_of())
    dc = math.sqrt((4.0 + 1.0 + 0.25) / 3.0)
    assert result.orders[1].relative_to_l0 == pytest.approx(0.05 / dc)
    assert result.orders[1].relative_to_own_size == pytest.approx(0.05 / abs(0.2 - 0.1j))
    assert result.orders[0].relative_to_l0 == 0.0
    assert result.orders[2].relative_to_l0 == 0.0
    # two of the six coefficients of orders 1 and 2 are wrong
    assert result.all_orders is not None
    assert result.all_orders.relative_to_l0 == pytest.approx(0.05 / dc * math.sqrt(2 / 6))


def test_the_first_ten_frames_do_not_count():
    records = [record_of(i, true_light() * (5.0 if i < 10 else 1.0)) for i in range(FRAMES)]
    result = evaluate(log_of(records), truth_of())
    assert result.settled
    assert result.orders[0].relative_to_l0 == pytest.approx(0.0)


def test_a_short_clip_counts_every_frame():
    result = evaluate(log_of([record_of(i, true_light() * 1.1) for i in range(4)]), truth_of(4))
    assert not result.settled
    assert result.orders[0].relative_to_l0 == pytest.approx(0.1)


def test_a_missing_estimate_is_wrong_without_bound():
    records = [record_of(i, None if i > 12 else true_light()) for i in range(FRAMES)]
    assert evaluate(log_of(records), truth_of()).orders[0].relative_to_l0 == math.inf


def test_frames_that_were_not_written_are_not_tracked():
    result = evaluate(log_of([record_of(i, true_light()) for i in range(15)]), truth_of(20))
    assert result.tracked_share == pytest.approx(0.75)


def test_pose_error_is_the_shift_of_the_sheet_in_the_picture():
    shifted = Pose(POSE.rotation, POSE.translation + [0.4, 0.0, 0.0])  # 500 px * 0.4 mm / 400 mm
    records = [record_of(i, true_light(), shifted if i == 5 else POSE) for i in range(FRAMES)]
    pose = evaluate(log_of(records), truth_of()).pose
    assert pose is not None
    assert pose.worst_px == pytest.approx(0.5, rel=1e-6)
    assert pose.median_px == pytest.approx(0.0, abs=1e-6)
    assert pose.rms_px == pytest.approx(0.5 / math.sqrt(FRAMES), rel=1e-6)


def test_coasting_frames_do_not_count_for_the_pose():
    away = Pose(POSE.rotation, POSE.translation + [9.0, 0.0, 0.0])
    records = [
        record_of(i, true_light(), *((away, "coasting") if i == 5 else (POSE, "tracked"))) for i in range(FRAMES)
    ]
    result = evaluate(log_of(records), truth_of())
    assert result.pose is not None
    assert result.pose.worst_px == pytest.approx(0.0, abs=1e-9)
    assert result.tracked_share == pytest.approx(0.95)


def test_only_common_frequencies_are_compared_in_whatever_order():
    truth = truth_of()
    turned = tuple(replace(frame, coefficients=frame.coefficients[::-1][2:]) for frame in truth.frames)
    reversed_truth = ClipTruth("hall", FREQUENCIES[::-1][2:], turned)
    result = evaluate(log_of([record_of(i, true_light()) for i in range(FRAMES)]), reversed_truth)
    assert all(error.relative_to_l0 == 0.0 for error in result.orders)


def test_log_and_truth_of_different_clips_are_refused():
    with pytest.raises(LogError, match="no frame in common"):
        evaluate(log_of([record_of(50, true_light())]), truth_of())
