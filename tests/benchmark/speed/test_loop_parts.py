"""Loop, coding, drawing, start and memory: that all is measured that is told of."""

import pytest

from arlight.benchmark.speed.budget_part import BUDGETS_MS, measure_budgets
from arlight.benchmark.speed.coding_part import measure_coding
from arlight.benchmark.speed.drawing_part import CONVERSION, OPENGL, measure_drawing
from arlight.benchmark.speed.loop_part import measure_loop
from arlight.benchmark.speed.memory_part import measure_memory
from arlight.benchmark.speed.relighters import Relighters
from arlight.benchmark.speed.start_part import measure_start
from arlight.presets import EncodingSettings, Preset
from arlight.rendering.settings import RelightSettings

COARSE = RelightSettings(directions=64, shadow_texels=32, supersampling=1)


@pytest.fixture(scope="module")
def relighter(clip):
    relighters = Relighters()
    yield relighters.of(clip.probe, clip.camera, COARSE)
    relighters.release()


def test_the_loop_is_run_as_often_as_the_transcode_on_the_same_frames(clip, relighter, tmp_path):
    found = measure_loop(clip, 12, 2, Preset(relight=COARSE), relighter, tmp_path)
    (loop,) = found.details["loop"]
    assert loop["frames"] == 12
    ratio = found.ratios["loop, tiny"].value
    assert ratio.count == 2
    assert 1e3 / loop["wall_ms"]["median"] == pytest.approx(loop["frames_per_second"])


def test_every_frame_under_a_deadline_is_made_or_left_out_and_some_are_judged(clip, relighter, tmp_path):
    found = measure_budgets(clip, 1.5, relighter, relighter, tmp_path)
    rows = found.details["budget"]
    assert [row["budget_ms"] for row in rows] == list(BUDGETS_MS)
    for row in rows:
        assert sum(row["frames_at_rung"]) + row["left_out"] == row["frames"] >= 36
        assert row["in_time"] == pytest.approx((sum(row["frames_at_rung"]) - row["late"]) / row["frames"])
        assert found.errors[f"relit picture, {row['budget_ms']:g} ms a frame"] == row["relighting_error"]
    # a deadline of a second is held, with nothing given up; the picture is then nearly the true one
    leisure = measure_budgets(clip, 1.5, relighter, relighter, tmp_path, (1000.0,)).details["budget"][0]
    assert leisure["late"] == leisure["left_out"] == 0
    assert leisure["frames_at_rung"][0] == leisure["frames"]
    assert leisure["relighting_error"] < 0.2


def test_reading_and_writing_are_counted_by_the_frame(clip, tmp_path):
    found = measure_coding(clip, 2, EncodingSettings(), tmp_path)
    assert set(found.ratios) == {"decode, tiny", "encode, tiny"}
    assert all(ratio.value.count == 2 and ratio.value.median > 0.0 for ratio in found.ratios.values())


def test_drawing_and_compositing_have_yardsticks_of_their_own(clip, relighter):
    found = measure_drawing(clip, 5, relighter)
    yardsticks = {name.split(",")[0]: ratio.over for name, ratio in found.ratios.items()}
    assert yardsticks["render"] == yardsticks["relight"] == OPENGL
    assert yardsticks["composite"] == CONVERSION
    (row,) = found.details["drawing"]
    assert row["cpu_ms"]["render"]["count"] == 4


def test_a_fresh_process_has_its_first_result_after_it_has_imported_what_it_needs(clip, tmp_path):
    found = measure_start(clip, 1, tmp_path)
    start = found.details["start"]
    assert start["run_of_one_frame_cpu_s"] > start["imports_cpu_s"] > 0.0
    assert start["first_result_s"] > 0.0
    assert start["first_result_cold_s"] > 0.0
    assert found.ratios["run of one frame, tiny"].value.median > 1.0


def test_memory_is_measured_on_clips_of_both_lengths(clip, tmp_path):
    found = measure_memory(clip, (0.2, 0.4), tmp_path)
    short, long = found.details["memory"]
    assert long["frames"] == 2 * short["frames"]
    assert found.errors["peak memory, long clip over short"] == pytest.approx(long["peak_mb"] / short["peak_mb"])
