"""The layers of a sheet, recovered from a camera that moves over it under light that nobody told."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from arlight.calibration.layers.layer_parameters import NAMES, STDDEV, vector_of
from arlight.calibration.layers.self_calibration import self_calibrate
from arlight.color import encoded_from_linear
from arlight.errors import CalibrationError
from arlight.video.frame import Frame

LAYERS = NAMES[: NAMES.index("vignetting_k1")]


@pytest.fixture(scope="module")
def errors(filmed_sheet, self_calibrated):
    """Error of every parameter, and the standard deviation that comes with it."""
    truth = dict(zip(NAMES, vector_of(filmed_sheet.assembly), strict=True))
    return {name: (self_calibrated.values[name] - truth[name], self_calibrated.stddev[name]) for name in NAMES}


@pytest.mark.parametrize("layer", ["film", "paper"])
def test_the_layers_are_found_where_they_lie(errors, layer):
    # whether fingers were a tenth of a millimetre off is known to a hundredth
    for axis in "xy":
        assert errors[f"{layer}_{axis}_mm"][0] == pytest.approx(0.0, abs=0.01)
    assert errors[f"{layer}_rotation_deg"][0] == pytest.approx(0.0, abs=0.05)
    assert errors[f"{layer}_scale"][0] == pytest.approx(0.0, abs=3e-4)


def test_the_glass_is_measured_to_half_a_per_cent(errors):
    assert errors["glass_scale"][0] == pytest.approx(0.0, abs=0.005)


def test_the_prints_are_found_as_they_were_printed(filmed_sheet, self_calibrated):
    for name in ("film", "paper"):
        found, true = getattr(self_calibrated.assembly, name), getattr(filmed_sheet.assembly, name)
        assert found.blur_mm == pytest.approx(true.blur_mm, abs=0.012)
        assert found.dot_gain == pytest.approx(true.dot_gain, abs=0.012)
        assert found.solid == pytest.approx(true.solid, abs=0.008)


def test_the_lens_has_no_vignetting_of_its_own(self_calibrated):
    # gain at the sheet's far corner, at 0.7 of the picture's half diagonal
    k1, k2, k3 = self_calibrated.vignetting
    assert 0.5 * k1 + 0.25 * k2 + 0.125 * k3 == pytest.approx(0.0, abs=0.02)


def test_the_errors_are_as_large_as_is_said(errors):
    normalised = np.array([errors[name][0] / errors[name][1] for name in LAYERS])
    assert np.abs(normalised).max() < 5.0
    # neither boasting nor useless
    assert 0.3 < np.sqrt(np.mean(normalised**2)) < 2.5


def test_what_the_views_told_is_far_better_than_a_guess(filmed_sheet, self_calibrated):
    told = [name for name in NAMES if name not in self_calibrated.undetermined]
    assert self_calibrated.views == len(filmed_sheet.seen)
    assert {"film_x_mm", "paper_x_mm", "paper_rotation_deg", "glass_scale", "paper_dot_gain"} <= set(told)
    for name, stddev in zip(NAMES, STDDEV, strict=True):
        assert self_calibrated.stddev[name] <= stddev
        assert (self_calibrated.stddev[name] <= 0.5 * stddev) == (name in told)


def test_the_order_of_the_views_does_not_matter(filmed_sheet, self_calibrated):
    shuffled = [filmed_sheet.seen[i] for i in np.random.default_rng(3).permutation(len(filmed_sheet.seen))]
    again = self_calibrate(shuffled, filmed_sheet.probe, filmed_sheet.camera)
    assert again.chi2 == pytest.approx(self_calibrated.chi2, rel=1e-6)
    for name in NAMES:
        assert again.values[name] == pytest.approx(self_calibrated.values[name], abs=1e-4 * again.stddev[name])


def test_drifting_exposure_does_not_disturb(filmed_sheet, self_calibrated):
    def exposed(number, seen):
        gain = 1.0 + 0.25 * np.sin(number)
        encoded = encoded_from_linear(np.clip(gain * seen.frame.linear_rgb(), 0.0, 1.0))
        image = np.rint(255.0 * encoded).astype(np.uint8)
        return replace(seen, frame=Frame.from_rgb(image, seen.frame.index, seen.frame.time_s))

    drifting = [exposed(number, seen) for number, seen in enumerate(filmed_sheet.seen)]
    found = self_calibrate(drifting, filmed_sheet.probe, filmed_sheet.camera)
    for name in LAYERS:
        # coarser levels of the dark frames are all that differs
        assert found.values[name] == pytest.approx(self_calibrated.values[name], abs=1.5 * found.stddev[name])


def test_progress_counts_up_to_the_end(filmed_sheet):
    steps = []
    self_calibrate(filmed_sheet.seen[::2], filmed_sheet.probe, filmed_sheet.camera, lambda *step: steps.append(step))
    done, total = np.array(steps).T
    assert len(set(total)) == 1
    assert np.all(np.diff(done) >= 0)
    assert 0 < done[0] < done[-1] == total[0]


def test_few_views_are_refused(filmed_sheet):
    for count in (0, 3):
        with pytest.raises(
            CalibrationError, match=rf"found in {count} frames; .* needs 4 or more .* film a few seconds"
        ):
            self_calibrate(filmed_sheet.seen[:count], filmed_sheet.probe, filmed_sheet.camera)


def test_a_camera_that_stands_still_is_refused(filmed_sheet):
    with pytest.raises(CalibrationError, match=r"hardly moved around the sheet: .* film a few seconds while moving"):
        self_calibrate(filmed_sheet.seen[:1] * 12, filmed_sheet.probe, filmed_sheet.camera)


def test_a_covered_sheet_is_refused(filmed_sheet):
    half = max(abs(c) + b.size_mm for b in filmed_sheet.probe.blocks if b.kind == "pattern" for c in b.center_mm)
    corners = half * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])

    def covered(seen):
        image = np.rint(255.0 * seen.frame.encoded_rgb()).astype(np.uint8)
        outline = filmed_sheet.camera.project(seen.pose.camera_from_probe, corners)
        cv2.fillConvexPoly(image, np.rint(outline).astype(np.int32), (60, 60, 60))
        return replace(seen, frame=Frame.from_rgb(image, seen.frame.index, seen.frame.time_s))

    with pytest.raises(CalibrationError, match=r"do not tell .* from the light .* move the camera further"):
        self_calibrate([covered(seen) for seen in filmed_sheet.seen], filmed_sheet.probe, filmed_sheet.camera)
