"""The calibration against a rendered sheet whose layers were warped and whose blocks were spoilt as pixels."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.known_lighting.calibration import KnownLightingCalibration, calibrate_known
from arlight.calibration.known_lighting.checks import check_match
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.errors import CalibrationError
from arlight.tracking.block_layout import field_blocks


def calibrated(sheet, lights=None, seen=None, **options) -> KnownLightingCalibration:
    return calibrate_known(seen or sheet.seen, lights or sheet.lights, sheet.probe, sheet.camera, **options)


def chosen(sheet, numbers):
    """Lights and frames of some lightings, numbered anew."""
    lights = [sheet.lights[number] for number in numbers]
    frames = [
        replace(frame, light=new) for new, old in enumerate(numbers) for frame in sheet.seen if frame.light == old
    ]
    return lights, frames


@pytest.fixture(scope="module")
def result(lit_sheet):
    return calibrated(lit_sheet)


def test_layers_are_found(lit_sheet, result):
    truth = lit_sheet.assembly
    for layer in ("film", "paper"):
        found, true = getattr(result.assembly, layer), getattr(truth, layer)
        np.testing.assert_allclose(found.registration.shift_mm, true.registration.shift_mm, atol=0.01)
        assert found.registration.rotation_deg == pytest.approx(true.registration.rotation_deg, abs=0.05)
        assert found.dot_gain == pytest.approx(true.dot_gain, abs=0.02)
        assert found.solid == pytest.approx(true.solid, abs=0.015)
    assert result.assembly.glass_scale == pytest.approx(truth.glass_scale, abs=0.005)
    assert result.values["reflectance"] == pytest.approx(1.0, abs=0.02)


def test_spoilt_blocks_are_found_corrected_and_named(lit_sheet, result):
    blocks = result.assembly.blocks
    found = {
        "gain": blocks.gain / np.median(blocks.gain), "phase_deg": blocks.phase_deg, "modulation": blocks.modulation
    }  # fmt: skip
    tolerance = {"gain": 0.02, "phase_deg": 3.0, "modulation": 0.04}
    healthy = np.ones(len(blocks.gain), bool)
    for kind, (place, true) in lit_sheet.spoilt.items():
        assert found[kind][place] == pytest.approx(true, abs=tolerance[kind]), kind
        healthy[place] = False
    for kind, values in found.items():
        model = 0.0 if kind == "phase_deg" else 1.0
        assert np.all(np.abs(values[healthy] - model) < tolerance[kind]), kind
    ids = [block.id for block in field_blocks(lit_sheet.probe)]
    assert {block.id for block in result.distrusted} == {ids[place] for place, _ in lit_sheet.spoilt.values()}


def test_lightings_are_told_by_the_others(result):
    assert len(result.errors) == 3
    for error in result.errors:
        assert error.orders.shape == (3,)
        assert np.all(error.orders < [0.02, 0.02, 0.02])
    assert 1.0 < result.condition < 100.0


def test_two_lightings_do_for_many_blocks(lit_sheet):
    lights, seen = chosen(lit_sheet, [0, 2])
    found = calibrated(lit_sheet, lights, seen)
    assert all(np.all(error.orders < 0.03) for error in found.errors)
    shift = found.assembly.paper.registration.shift_mm
    np.testing.assert_allclose(shift, lit_sheet.assembly.paper.registration.shift_mm, atol=0.015)


def test_open_brightness_is_found_and_leaves_the_layers(lit_sheet, result):
    dimmed = [replace(light, environment=light.environment.scaled(0.25)) for light in lit_sheet.lights]
    found = calibrated(lit_sheet, dimmed, relative=True)
    np.testing.assert_allclose(found.exposures, 4.0, rtol=0.03)
    shift = found.assembly.paper.registration.shift_mm
    np.testing.assert_allclose(shift, result.assembly.paper.registration.shift_mm, atol=0.003)
    assert found.assembly.glass_scale == pytest.approx(result.assembly.glass_scale, abs=0.002)


def test_swapped_environments_are_refused_and_recognised(lit_sheet):
    swapped = [lit_sheet.lights[1], lit_sheet.lights[0], *lit_sheet.lights[2:]]
    with pytest.raises(CalibrationError, match=r"light[01].*does not match.*look like those of light[01]"):
        calibrated(lit_sheet, swapped)


def test_a_brightness_that_cannot_be_is_refused_unless_it_is_open(lit_sheet, result):
    bright = replace(result.errors[1], orders=np.array([0.5, 0.02, 0.02]))
    errors = [result.errors[0], bright, result.errors[2]]
    check_match(errors, lit_sheet.lights, lit_sheet.probe, relative=True)
    with pytest.raises(CalibrationError, match=r"light1.*50 %.*--relative"):
        check_match(errors, lit_sheet.lights, lit_sheet.probe, relative=False)


def test_a_turned_environment_is_recognised(lit_sheet, result):
    turned = replace(lit_sheet.lights[2], environment=lit_sheet.lights[2].environment.rotated(np.deg2rad(-90.0)))
    errors = [*result.errors[:2], replace(result.errors[2], shape=0.4)]
    with pytest.raises(CalibrationError, match=r"light2.*turned by another \+90 degrees"):
        check_match(errors, [*lit_sheet.lights[:2], turned], lit_sheet.probe, relative=False)


def test_one_lighting_is_refused(lit_sheet):
    lights, seen = chosen(lit_sheet, [0])
    with pytest.raises(CalibrationError, match="2 or more"):
        calibrated(lit_sheet, lights, seen)


def test_lights_all_alike_are_refused(lit_sheet):
    _, seen = chosen(lit_sheet, [0, 0])
    first = lit_sheet.lights[0]
    again = KnownLight("again", first.environment.scaled(2.0), first.refractive_index)
    with pytest.raises(CalibrationError, match="the same light but for their brightness"):
        calibrated(lit_sheet, [first, again], seen)


def test_a_lighting_without_frames_is_refused(lit_sheet):
    _, seen = chosen(lit_sheet, [0])
    with pytest.raises(CalibrationError, match="light1: none of its frames"):
        calibrated(lit_sheet, lit_sheet.lights[:2], seen)
