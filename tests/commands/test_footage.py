"""A clip with the probe and camera that belong to it."""

import math
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.commands.footage import check_result, open_footage, shows_the_sheet
from arlight.commands.options.footage import FootageOptions
from arlight.errors import CameraError, ProbeError, VideoError
from arlight.probe.assembly import Assembly
from arlight.probe.assembly_storage import save_assembly
from arlight.results.record import LogRecord
from arlight.results.statistics import RunStatistics


def seen(status: str) -> RunStatistics:
    statistics = RunStatistics()
    statistics.add(LogRecord(0, 0.0, status, None, 0.0, None, None, None, 1.0, {}))
    return statistics


def test_sidecars_are_found_by_themselves(footage):
    with open_footage(footage / "orbit.mp4", FootageOptions()) as found:
        assert found.probe_path == footage / "probe.json"
        assert found.camera_path == footage / "camera.json"
        assert found.probe.order == 1
        assert found.camera.image_size == found.reader.size == (320, 240)


def test_what_is_given_goes_before_what_lies_beside(footage, tmp_path):
    given = shutil.copy(footage / "probe.json", tmp_path / "given.json")
    with open_footage(footage / "orbit.mp4", FootageOptions(probe=given)) as found:
        assert found.probe_path == given


def test_missing_sidecars_and_wrong_sizes_are_refused(footage, tmp_path):
    clip = shutil.copy(footage / "orbit.mp4", tmp_path / "clip.mp4")
    with pytest.raises(ProbeError, match=r"clip\.mp4: no probe\.json beside it"):
        open_footage(clip, FootageOptions())
    camera = Camera.load(footage / "camera.json")
    Camera((320, 200), camera.camera_matrix, camera.distortion).save(tmp_path / "low.json")
    with pytest.raises(CameraError, match=r"low\.json: is for pictures of 320x200.*320x240"):
        open_footage(clip, FootageOptions(probe=footage / "probe.json", camera=tmp_path / "low.json"))


def test_without_a_camera_the_focal_length_comes_from_the_clip(footage, tmp_path):
    clip = shutil.copy(footage / "orbit.mp4", tmp_path / "clip.mp4")
    true = Camera.load(footage / "camera.json").camera_matrix
    with open_footage(clip, FootageOptions(probe=footage / "probe.json")) as found:
        assert found.camera_path is None
        assert len(found.notes) == 1
        assert re.match(r".*clip\.mp4: no camera\.json: focal length \d+ px \+- ", found.notes[0])
        # half a second and 230 pixels of a small sheet
        np.testing.assert_allclose(found.camera.camera_matrix[[0, 1], [0, 1]], true[[0, 1], [0, 1]], rtol=0.06)


def test_vignetting_that_calibration_found_comes_on_top_of_the_camera_s(footage, tmp_path):
    camera = Camera.load(footage / "camera.json")
    replace(camera, vignetting=(-0.1, -0.02, 0.0)).save(tmp_path / "dark.json")
    save_assembly(Assembly(), tmp_path / "sheet.json", vignetting=(-0.05, 0.01, 0.0))
    options = FootageOptions(camera=tmp_path / "dark.json", calibration=tmp_path / "sheet.json")
    with open_footage(footage / "orbit.mp4", options) as found:
        np.testing.assert_allclose(found.camera.vignetting, (-0.15, -0.01, 0.0))
        assert found.calibration_path == tmp_path / "sheet.json"
        assert found.assembly == Assembly()
    with open_footage(footage / "orbit.mp4", FootageOptions()) as found:
        assert found.camera.vignetting is None
        assert found.assembly is None
        assert found.notes == ()


def test_a_run_that_saw_the_sheet_is_accepted(footage):
    with open_footage(footage / "orbit.mp4", FootageOptions()) as found:
        check_result(found, seen("tracked"))
        with pytest.raises(ProbeError, match="but not where"):
            check_result(found, seen("lost"))


def test_a_clip_without_markers_is_told_from_one_with_others(empty_table):
    with open_footage(empty_table, FootageOptions()) as found, pytest.raises(VideoError, match="no frame showed"):
        check_result(found, seen("lost"))


@pytest.mark.parametrize(("unexplained", "matches"), [(0.03, True), (math.nan, True), (0.6, False)])
def test_stripes_that_no_light_explains_are_refused(footage, unexplained, matches):
    statistics = RunStatistics()
    # one frame that is torn does not decide
    for share in (0.9, unexplained, unexplained) if unexplained == unexplained else (unexplained,):
        statistics.add(LogRecord(0, 0.0, "tracked", None, 0.0, None, None, None, 1.0, {}, share))
    with open_footage(footage / "orbit.mp4", FootageOptions()) as found:
        assert shows_the_sheet(statistics) == matches
        if matches:
            check_result(found, statistics)
            return
        with pytest.raises(
            ProbeError, match=r"probe\.json: does not match the footage.*orbit\.mp4.*60 %.*--probe FILE"
        ):
            check_result(found, statistics)
