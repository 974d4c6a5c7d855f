"""The paper's calibration on rendered frames: it needs one viewpoint, and breaks beside it."""

import numpy as np
import pytest

from arlight.calibration.known_lighting.fixed_matrix import angle_deg, by_offset, calibrate_fixed
from arlight.errors import CalibrationError
from arlight.estimation.fixed_estimator import FixedEstimator
from arlight.fourier import pack_real
from arlight.tracking.blocks import BlockMeter


def first_views(sheet):
    return [next(frame for frame in sheet.seen if frame.light == light) for light in range(len(sheet.lights))]


def test_lights_that_were_shown_are_returned_at_the_view_and_not_beside_it(lit_sheet):
    result = calibrate_fixed(first_views(lit_sheet), lit_sheet.lights, lit_sheet.probe, lit_sheet.camera)
    estimator = FixedEstimator(lit_sheet.probe, result.calibration)
    meter = BlockMeter(lit_sheet.probe, lit_sheet.camera)
    truth = lit_sheet.lights[0].packed(lit_sheet.probe.frequencies)

    def error(frame):
        means = meter.measure(frame.frame, frame.pose.camera_from_probe, frame.pose.blur_px)
        found = pack_real(estimator.estimate(means, 0.0).lighting.coefficients)
        return float(np.sqrt(np.mean((found - truth)[1:] ** 2)) / truth[0].mean())

    at, near, far = (error(frame) for frame in (first_views(lit_sheet)[0], *lit_sheet.beside))
    assert at < 0.1
    assert at < near < far
    assert far > 0.3


def test_frames_beside_the_viewpoint_only_fill_the_table(lit_sheet):
    frames = first_views(lit_sheet)
    alone = calibrate_fixed(frames, lit_sheet.lights, lit_sheet.probe, lit_sheet.camera)
    more = calibrate_fixed([*lit_sheet.beside, *frames], lit_sheet.lights, lit_sheet.probe, lit_sheet.camera)
    assert {row.offset_deg for row in more.offsets} == {0.0, 5.0, 20.0}
    assert {row.offset_deg for row in alone.offsets} == {0.0}
    assert [row.frames for row in more.offsets] == [3, 1, 1]
    np.testing.assert_allclose(more.calibration.means, alone.calibration.means)


def test_lightings_from_different_viewpoints_are_refused(lit_sheet):
    frames = first_views(lit_sheet)
    frames[1] = next(frame for frame in lit_sheet.seen if frame.light == 1 and frame is not frames[1])
    with pytest.raises(CalibrationError, match="one viewpoint"):
        calibrate_fixed(frames, lit_sheet.lights, lit_sheet.probe, lit_sheet.camera)


def test_angles_are_between_directions_to_the_camera(lit_sheet):
    frame, (near, far) = first_views(lit_sheet)[0], lit_sheet.beside
    assert angle_deg(frame, frame) == pytest.approx(0.0, abs=1e-5)
    assert angle_deg(near, frame) == pytest.approx(5.0, abs=1e-6)
    assert angle_deg(far, frame) == pytest.approx(20.0, abs=1e-6)


def test_offsets_take_the_nearest_frames():
    errors = [np.array([value]) for value in (1.0, 2.0, 4.0, 8.0, 100.0)]
    table = by_offset([0.4, 0.8, 1.4, 19.0, 60.0], errors)
    assert [(row.offset_deg, row.frames, row.orders[0]) for row in table] == [
        (0.0, 2, 1.5),
        (2.0, 1, 4.0),
        (20.0, 1, 8.0),
    ]
