"""Calibrations proven on path-traced clips: a sheet with every flaw, halftones, vignetting, noise and H.264."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from arlight.benchmark.proof import GROUPS, Treatment, calibrated, judge, medians, uncorrected
from arlight.calibration.layers.self_calibration import self_calibrate
from arlight.calibration.layers.view_measurement import find_sheet
from arlight.camera import Camera
from arlight.errors import VideoError
from arlight.probe.assembly import Assembly, Print, Registration
from arlight.probe.assembly_storage import load_assembly
from arlight.probe.storage import load_probe
from arlight.tracking.block_layout import field_blocks
from arlight.video.reader import VideoReader

TRACED = Path(__file__).parents[1] / "data" / "traced"
CLIP = TRACED / "orbit-hall.mp4"
PROBE = load_probe(TRACED / "probe.json")
CAMERA = Camera.load(TRACED / "camera.json")
TRUE = load_assembly(TRACED / "assembly.json", len(field_blocks(PROBE)))


@pytest.fixture(scope="module")
def found():
    """The sheet from every third frame of the clip."""
    with threadpool_limits(limits=1, user_api="blas"), VideoReader(CLIP) as reader:
        seen = find_sheet(reader, PROBE, CAMERA)
        return self_calibrate(seen[::3], PROBE, CAMERA)


@pytest.fixture(scope="module")
def results(found):
    whole = calibrated("self-calibrated", found, CAMERA)
    shift = next(iter(uncorrected(whole)))
    treatments = (Treatment("as designed", None, CAMERA), whole, shift)
    return {treatment.name: judge(CLIP, PROBE, treatment) for treatment in treatments}


def test_self_calibration_finds_the_traced_sheet(found):
    film, paper = found.assembly.film.registration, found.assembly.paper.registration
    between = np.subtract(paper.shift_mm, film.shift_mm)
    true = np.subtract(TRUE.paper.registration.shift_mm, TRUE.film.registration.shift_mm)
    assert np.abs(between - true).max() < 0.01
    turn = TRUE.paper.registration.rotation_deg - TRUE.film.registration.rotation_deg
    assert paper.rotation_deg - film.rotation_deg == pytest.approx(turn, abs=0.05)
    assert found.assembly.glass_scale == pytest.approx(TRUE.glass_scale, rel=0.005)
    assert found.assembly.paper.blur_mm == pytest.approx(TRUE.paper.blur_mm, abs=0.01)
    assert found.assembly.paper.dot_gain == pytest.approx(TRUE.paper.dot_gain, abs=0.01)


def test_calibrated_light_is_the_environments(results):
    errors = {group: float(np.median(results["self-calibrated"].errors[group])) for group in GROUPS}
    assert errors["0"] < 0.02
    assert errors["1-3"] < 0.015
    assert errors["4-5"] < 0.02


def test_error_bars_are_of_the_errors_size(results):
    # one clip is one draw of the errors that its frames share; the average over many is what must be near 1
    assert 0.1 < results["self-calibrated"].normalised_raw < 3.0
    assert 0.1 < results["self-calibrated"].normalised_filtered < 3.0


def test_an_uncalibrated_sheet_is_of_no_use(results):
    worst = medians(list(results.values()), "as designed")
    assert all(worst[group] > 0.1 for group in GROUPS)
    assert np.median(results["shift of the paper"].errors["4-5"]) > 0.1


def test_each_flaw_is_left_out_alone():
    whole = Treatment("whole", TRUE, replace(CAMERA, vignetting=(-0.1, 0.0, 0.0)))
    left = {treatment.name: treatment for treatment in uncorrected(whole)}
    assert left["thickness of the glass"].assembly == replace(TRUE, glass_scale=1.0)
    assert left["vignetting"].camera.vignetting is None
    assert left["dot gain"].assembly.film.dot_gain == left["dot gain"].assembly.paper.dot_gain == 0.0
    assert left["dot gain"].assembly.film.blur_mm == TRUE.film.blur_mm
    moved = left["place of the film"].assembly
    assert moved.film.registration == Registration()
    np.testing.assert_allclose(
        np.subtract(TRUE.paper.registration.shift_mm, TRUE.film.registration.shift_mm),
        moved.paper.registration.shift_mm,
    )
    assert not left["light bounced in the sheet"].settings.bounces
    assert len(left) == 9


def test_a_clip_that_is_too_short_is_refused():
    known = TRACED / "known-apartment.mp4"
    with pytest.raises(VideoError, match=r"known-apartment.*first 10"):
        judge(known, PROBE, Treatment("any", Assembly(film=Print()), CAMERA))
