"""`arlight run` with a sheet that was not put together as designed, with a camera that has no file, with L = MV."""

import re
import shutil
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.estimation.fixed_estimator import FixedEstimator, fixed_calibration
from arlight.fourier import pack_real
from arlight.probe.assembly import Assembly, BlockCorrections, Print, Registration
from arlight.probe.assembly_storage import save_assembly
from arlight.probe.layout import design_probe
from arlight.probe.storage import load_probe, save_probe
from arlight.results.log import read_log
from arlight.synthetic.clip import write_clip
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.truth import load_truth
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.blocks import BlockMeter
from arlight.video.reader import VideoReader

ASSEMBLY = Assembly(paper=Print(Registration((0.15, -0.1), 0.2)), glass_scale=1.02)
SETTINGS = SynthesisSettings(
    camera=default_camera((640, 480)),
    sheet_width_px=420.0,
    duration_s=2.0,
    frame_rate=Fraction(8),
    bounces=1,
)


@pytest.fixture(scope="module")
def assembled(tmp_path_factory):
    """A folder with orbit.mp4 of an order-1 sheet whose paper lies 0.18 mm off, under glass that is 2 % thicker."""
    folder = tmp_path_factory.mktemp("assembled")
    write_clip(folder, "orbit", SETTINGS, design_probe(1), assembly=ASSEMBLY, preset="ultrafast")
    return folder


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    """A folder with hall.mp4 and bridge.mp4 of an order-1 sheet, from one viewpoint."""
    folder = tmp_path_factory.mktemp("still")
    for environment in ("hall", "bridge"):
        settings = SynthesisSettings(
            environment=environment,
            camera=default_camera((320, 240)),
            path="still",
            sheet_width_px=230.0,
            duration_s=0.5,
            frame_rate=Fraction(10),
            bounces=0,
        )
        write_clip(folder, environment, settings, design_probe(1), preset="ultrafast")
    return folder


def errors(log, folder, name="orbit"):
    """Median error of orders 0 and 1 over the frames, relative to |L_0|."""
    truth = load_truth(folder / f"{name}.truth.json")
    found = []
    for record, true in zip(read_log(log).records, truth.frames, strict=True):
        error = np.abs(record.coefficients - true.coefficients) / np.sqrt(np.mean(np.abs(true.coefficients[0]) ** 2))
        found.append([np.sqrt(np.mean(error[:1] ** 2)), np.sqrt(np.mean(error[1:] ** 2))])
    return np.median(found, axis=0)


def test_a_sheet_that_lies_wrong_is_calibrated_on_the_clip_itself(arlight, assembled):
    clip = assembled / "orbit.mp4"
    assert arlight("run", clip, "--no-render", "--lighting", "designed.jsonl").status == 0
    done = arlight("run", clip, "--no-render", "--self-calibrate", "--lighting", "self.jsonl")
    assert done.status == 0, done.errors
    assert re.search(r"orbit\.mp4: sheet calibrated on \d+ views", done.output)
    # 0.18 mm are 15 degrees of the coarsest stripes
    assert errors("designed.jsonl", assembled)[1] > 0.1
    assert np.all(errors("self.jsonl", assembled) < 0.03)


@pytest.mark.parametrize("place", ["orbit.calibration.json", "calibration.json", "elsewhere.json"])
def test_a_calibration_is_found_beside_the_clip_or_given(arlight, assembled, tmp_path, place):
    for name in ("orbit.mp4", "probe.json", "camera.json"):
        shutil.copy(assembled / name, tmp_path / name)
    save_assembly(ASSEMBLY, tmp_path / place)
    given = ("--calibration", place) if place == "elsewhere.json" else ()
    done = arlight("run", "orbit.mp4", "--no-render", "--lighting", "log.jsonl", *given)
    assert done.status == 0, done.errors
    assert f"sheet as in {place}" in done.output
    assert np.all(errors("log.jsonl", assembled) < 0.03)


def test_a_calibration_is_not_written_over(arlight, assembled, tmp_path):
    for name in ("orbit.mp4", "probe.json", "camera.json"):
        shutil.copy(assembled / name, tmp_path / name)
    save_assembly(ASSEMBLY, tmp_path / "calibration.json")
    before = (tmp_path / "calibration.json").read_bytes()
    done = arlight("run", "orbit.mp4", "--no-render", "--lighting", "calibration.json")
    assert done.status == 1
    assert "calibration.json: --lighting would overwrite" in done.errors
    assert (tmp_path / "calibration.json").read_bytes() == before


def test_a_camera_without_a_file_is_estimated_and_told(arlight, assembled, tmp_path):
    shutil.copy(assembled / "orbit.mp4", tmp_path / "clip.mp4")
    shutil.copy(assembled / "probe.json", tmp_path / "probe.json")
    save_assembly(ASSEMBLY, tmp_path / "calibration.json")
    done = arlight("run", "clip.mp4", "--no-render", "--lighting", "log.jsonl")
    assert done.status == 0, done.errors
    told = re.search(r"clip\.mp4: no camera\.json: focal length (\d+) px \+- ([\d.]+) %", done.output)
    assert told is not None
    focal = Camera.load(assembled / "camera.json").camera_matrix[1, 1]
    assert abs(int(told[1]) / focal - 1.0) < max(3.0 * float(told[2]) / 100.0, 0.02)
    assert np.all(errors("log.jsonl", assembled) < 0.04)


def test_a_camera_that_cannot_be_estimated_is_asked_for(arlight, empty_table, footage, tmp_path):
    shutil.copy(empty_table, tmp_path / "clip.mp4")
    shutil.copy(footage / "probe.json", tmp_path / "probe.json")
    done = arlight("run", "clip.mp4", "--no-render")
    assert done.status == 1
    assert re.search(r"clip\.mp4: the camera cannot be estimated.*--camera FILE", done.errors)
    assert not (tmp_path / "clip.jsonl").exists()


def test_a_camera_that_does_not_move_calibrates_nothing(arlight, still, tmp_path):
    done = arlight("run", still / "hall.mp4", "--no-render", "--self-calibrate")
    assert done.status == 1
    assert re.search(r"hall\.mp4: .*(move|motion)", done.errors), done.errors
    assert list(tmp_path.iterdir()) == []


def other_sheet(path):
    blocks = len(field_blocks(design_probe(2)))
    ones, zeros = np.ones(blocks), np.zeros(blocks)
    save_assembly(Assembly(blocks=BlockCorrections(ones, zeros, ones, zeros)), path)


REFUSED = {
    "a calibration twice": (["--calibration", "good.json", "--self-calibrate"], r"good\.json: --self-calibrate makes"),
    "a missing calibration": (["--calibration", "none.json"], r"none\.json: cannot be read.*calibration\.json"),
    "a calibration that is none": (["--calibration", "text.json"], r"text\.json: expected JSON"),
    "a probe as calibration": (["--calibration", "probe.json"], r"probe\.json: format: expected"),
    "another sheet's calibration": (
        ["--calibration", "other.json"],
        r"other\.json: blocks\.gain: expected a number for",
    ),
    "a matrix for the model": (["--calibration", "hall.fixed.npz"], r"hall\.fixed\.npz: expected JSON"),
    "L = MV without M": (["--estimator", "fixed"], r"--estimator fixed needs .*--calibration FILE"),
    "L = MV from itself": (["--estimator", "fixed", "--self-calibrate"], r"--estimator fixed needs known lighting"),
    "a missing M": (["--estimator", "fixed", "--calibration", "no.npz"], r"no\.npz: cannot be read"),
    "layers as M": (["--estimator", "fixed", "--calibration", "good.json"], r"good\.json: not a fixed calibration"),
    "a broken M": (["--estimator", "fixed", "--calibration", "cut.npz"], r"cut\.npz: not a fixed calibration"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_calibrations_are_refused_and_nothing_is_written(arlight, still, tmp_path, case):
    arguments, message = REFUSED[case]
    save_assembly(ASSEMBLY, tmp_path / "good.json")
    other_sheet(tmp_path / "other.json")
    shutil.copy(still / "probe.json", tmp_path / "probe.json")
    (tmp_path / "text.json").write_text("no calibration")
    matrix(still).save(tmp_path / "hall.fixed.npz")
    whole = (tmp_path / "hall.fixed.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    before = sorted(path.name for path in tmp_path.iterdir())
    done = arlight("run", still / "hall.mp4", "--no-render", *arguments)
    assert done.status == 1
    assert "Traceback" not in done.errors
    assert re.search(message, done.errors), done.errors
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def matrix(still):
    """L = MV from the clips of one viewpoint."""
    probe, camera = load_probe(still / "probe.json"), Camera.load(still / "camera.json")
    meter, means, lights, numbers = BlockMeter(probe, camera), [], [], []
    for number, name in enumerate(("hall", "bridge")):
        truth = load_truth(still / f"{name}.truth.json").frames[0]
        with VideoReader(still / f"{name}.mp4") as reader:
            means.append(meter.measure(next(iter(reader)), truth.pose))
        lights.append(pack_real(truth.coefficients))
        numbers.append(number)
    return fixed_calibration(probe, means, lights, numbers)


@pytest.mark.parametrize("name", ["hall", "bridge"])
def test_the_lighting_is_what_the_matrix_makes_of_the_blocks(arlight, still, tmp_path, name):
    calibration = matrix(still)
    calibration.save(tmp_path / "sheet.fixed.npz")
    options = ("--estimator", "fixed", "--calibration", "sheet.fixed.npz")
    clip = still / f"{name}.mp4"
    done = arlight("run", clip, "--no-render", "--lighting", "log.jsonl", *options)
    assert done.status == 0, done.errors
    probe, camera = load_probe(still / "probe.json"), Camera.load(still / "camera.json")
    meter, estimator = BlockMeter(probe, camera), FixedEstimator(probe, calibration)
    pose = load_truth(still / f"{name}.truth.json").frames[0].pose
    with VideoReader(clip) as reader:
        expected = np.mean([estimator.estimate(meter.measure(f, pose), 0.0).lighting.coefficients for f in reader], 0)
    found = read_log(tmp_path / "log.jsonl").records[-1].coefficients
    # the log's frames follow the tracked pose and guide chroma by the frame before
    np.testing.assert_allclose(found, expected, atol=0.01 * np.abs(expected[0]).max())


def test_another_sheet_s_matrix_is_refused(arlight, still, tmp_path):
    matrix(still).save(tmp_path / "sheet.fixed.npz")
    save_probe(design_probe(2), tmp_path / "probe.json")
    done = arlight(
        "run", still / "hall.mp4", "--no-render", "--probe", "probe.json", "--estimator", "fixed", "--calibration",
        "sheet.fixed.npz",
    )  # fmt: skip
    assert done.status == 1
    assert "sheet.fixed.npz: is of another sheet" in done.errors


def test_no_camera_and_automatic_exposure_cost_less_than_half_as_much_again(arlight, assembled, tmp_path):
    write_clip(
        tmp_path,
        "auto",
        replace(SETTINGS, exposure_swing=0.3, white_balance_drift=0.15),
        design_probe(1),
        assembly=ASSEMBLY,
        preset="ultrafast",
    )
    (tmp_path / "camera.json").unlink()
    save_assembly(ASSEMBLY, tmp_path / "sheet.json")
    options = ("--no-render", "--calibration", "sheet.json", "--lighting")
    for clip, log in ((assembled / "orbit.mp4", "locked.jsonl"), ("auto.mp4", "auto.jsonl")):
        done = arlight("run", clip, *options, log)
        assert done.status == 0, done.errors
    locked, auto = errors("locked.jsonl", assembled), errors("auto.jsonl", tmp_path, "auto")
    # errors below half a per cent are what one clip has by chance
    assert np.all(auto < 1.5 * np.maximum(locked, 0.005)), (locked, auto)
