"""Frames with their truth, from end to end on a small picture of a small sheet."""

from fractions import Fraction
from itertools import islice

import cv2
import numpy as np
import pytest

from arlight.errors import ArlightError, EnvironmentMapError
from arlight.probe.layout import design_probe
from arlight.synthetic.sensor import Sensor
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.synthesis import captured_light, synthesize

PROBE = design_probe(order=1, pixels_per_mm=8.0)
CLEAN = Sensor(0.4, 0.0, 0.0, 0.0)


def settings(**changes):
    base = {
        "environment": "apartment",
        "path": "still",
        "camera": default_camera((320, 180)),
        "sheet_width_px": 160.0,
        "duration_s": 0.2,
        "frame_rate": Fraction(10),
        "sensor": CLEAN,
        "bounces": 0,
    }
    return SynthesisSettings(**(base | changes))


@pytest.fixture(scope="module")
def layers():
    return SheetLayers.of_probe(PROBE)


def film(layers, **changes):
    return list(synthesize(settings(**changes), PROBE, layers))


@pytest.mark.usefixtures("needs_opengl")
def test_frames_come_in_order_with_their_times(layers):
    frames = film(layers, duration_s=0.3)
    assert [f.frame.index for f in frames] == [0, 1, 2]
    assert [f.truth.time_s for f in frames] == pytest.approx([0.0, 0.1, 0.2])
    assert all(f.frame.size == (320, 180) for f in frames)
    assert all(f.truth.coefficients.shape == (len(PROBE.frequencies), 3) for f in frames)


@pytest.mark.usefixtures("needs_opengl")
def test_white_paper_is_recorded_as_asked_where_the_pose_says(layers):
    frame, truth = (lambda f: (f.frame, f.truth))(film(layers, white=0.5)[0])
    # halfway between a corner marker's quiet zone and the outline the frame is white
    x, y = PROBE.sheet_mm[0] / 2 - 1.2, PROBE.sheet_mm[1] / 2 - 1.2
    corners = np.array([[-x, y, 0], [x, y, 0], [x, -y, 0], [-x, -y, 0]])
    pixels = np.rint(settings().filming_camera.project(truth.pose, corners)).astype(int)
    image = frame.linear_rgb()
    white = np.array([image[v, u] for u, v in pixels])
    assert white.max(axis=1) == pytest.approx(np.full(4, 0.5), abs=0.03)


@pytest.mark.usefixtures("needs_opengl")
def test_markers_are_found_where_the_pose_says(layers):
    synthetic = film(layers)[0]
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, PROBE.dictionary))
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(np.array(synthetic.frame.luma()))
    marker = {m.id: np.array(m.corners_mm) for m in PROBE.markers}
    assert ids is not None
    assert len(ids) >= len(marker) // 2
    for found, number in zip(corners, ids.ravel(), strict=True):
        points = np.column_stack([marker[int(number)], np.zeros(4)])
        expected = settings().filming_camera.project(synthetic.truth.pose, points)
        # ArUco's own accuracy without refinement, on markers of 12 pixels
        assert np.abs(found[0] - expected).max() < 1.5


@pytest.mark.usefixtures("needs_opengl")
def test_same_seed_same_clip(layers):
    noisy = Sensor(read_noise=0.01)
    one, same = film(layers, sensor=noisy, seed=4), film(layers, sensor=noisy, seed=4)
    other = film(layers, sensor=noisy, seed=5)
    np.testing.assert_array_equal(one[1].frame.planes, same[1].frame.planes)
    assert np.any(np.array(one[1].frame.planes) != np.array(other[1].frame.planes))


@pytest.mark.usefixtures("needs_opengl")
def test_switched_light_brightens_the_frame_it_switches_in(layers):
    # exposed for the brightest moment, as the coefficients say
    frames = film(layers, light="switch", second_environment="studio", change_s=0.1, duration_s=0.3)
    levels = np.array([f.frame.linear_rgb().mean() for f in frames])
    true = np.array([f.truth.coefficients[0].real.mean() for f in frames])
    assert true[1] > 1.05 * true[0]
    assert true[1] == true[2]
    # table and frame follow the open irradiance, the coefficient what passes the glass
    assert levels[1] / levels[0] == pytest.approx(true[1] / true[0], rel=0.05)
    assert levels[2] == pytest.approx(levels[1], rel=1e-3)


@pytest.mark.usefixtures("needs_opengl")
def test_turning_light_leaves_the_mean_coefficient_alone(layers):
    frames = film(layers, environment="bridge", light="turn", turn_deg_per_s=40.0)
    np.testing.assert_allclose(frames[0].truth.coefficients[0], frames[1].truth.coefficients[0], rtol=1e-6)
    assert np.abs(frames[1].truth.coefficients[1] - frames[0].truth.coefficients[1]).max() > 0.01
    changed = np.array(frames[1].frame.planes, int) - np.array(frames[0].frame.planes, int)
    assert np.abs(changed).max() > 2


@pytest.mark.usefixtures("needs_opengl")
def test_stopping_early_is_clean(layers):
    source = synthesize(settings(), PROBE, layers)
    assert len(list(islice(source, 1))) == 1
    source.close()
    assert next(source, None) is None


def test_missing_environment_is_refused():
    with pytest.raises(EnvironmentMapError, match=r"nowhere\.hdr"):
        next(synthesize(settings(environment="nowhere.hdr"), PROBE))


def test_switch_without_a_second_light_is_refused():
    with pytest.raises(ArlightError, match="second environment"):
        captured_light(settings(light="switch"))


@pytest.mark.usefixtures("needs_opengl")
def test_automatic_exposure_scales_picture_and_truth_alike(layers):
    locked = film(layers, duration_s=0.8, white=0.5)
    auto = film(layers, duration_s=0.8, white=0.5, exposure_swing=0.3, white_balance_drift=0.2)
    gains = []
    for one, other in zip(locked, auto, strict=True):
        gain = other.truth.coefficients[0].real / one.truth.coefficients[0].real
        np.testing.assert_allclose(other.truth.coefficients, one.truth.coefficients * gain, rtol=1e-12)
        assert other.truth.exposure == pytest.approx(one.truth.exposure * gain[1])
        # medians: codes are rounded
        before, after = one.frame.linear_rgb(), other.frame.linear_rgb()
        seen = np.all((before > 0.05) & (after < 0.9), axis=-1)
        np.testing.assert_allclose(np.median(after[seen] / before[seen], axis=0), gain, rtol=0.01)
        gains.append(gain)
    gains = np.array(gains)
    assert gains[:, 1].max() == pytest.approx(1.3)
    assert gains[:, 1].min() == pytest.approx(0.7)
    np.testing.assert_allclose(gains[-1] / gains[-1, 1], [1.0 + 0.2 * 7 / 8, 1.0, 1.0 - 0.2 * 7 / 8])
