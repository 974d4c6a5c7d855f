"""The views of the known-light set."""

import numpy as np

from arlight.probe.layout import design_probe
from arlight.validation import suite
from arlight.validation.filming import pose_at, proof_camera
from arlight.validation.proof_lights import KNOWN_LIGHTS, TEST_LIGHTS


def test_known_views_spread_over_15_to_50_degrees_and_stay_in_the_picture():
    probe, camera = design_probe(), proof_camera()
    stands = [suite._known_stand(index) for index in range(24)]
    tilts = np.sort([stand.tilt_deg for stand in stands])
    assert 15.0 <= tilts[0] < 18.0 < 48.0 < tilts[-1] <= 50.0
    assert np.diff(tilts).max() < 7.0
    for stand in stands:
        pose = pose_at(stand, camera, probe.sheet_mm)
        half = np.array(probe.sheet_mm) / 2
        corners = np.array([[x, y, 0.0] for x in (-half[0], half[0]) for y in (-half[1], half[1])])
        pixels = camera.project(pose, corners)
        assert np.all(pixels > 2.0)
        assert np.all(pixels < np.array(camera.image_size) - 3.0)


def test_no_light_serves_for_calibration_and_test():
    assert not set(TEST_LIGHTS) & set(KNOWN_LIGHTS)
    assert len(KNOWN_LIGHTS) == 8
