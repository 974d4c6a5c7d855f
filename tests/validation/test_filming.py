"""The proof's assembly, camera and paths are what they are said to be."""

import numpy as np
import pytest

from arlight.probe.layout import design_probe
from arlight.validation.filming import (
    TRACED_PATHS,
    ProofSensor,
    assembled_by_hand,
    pose_at,
    proof_camera,
    stand_on,
    vignetting,
)

PROBE = design_probe()


def test_paper_lies_a_tenth_of_a_millimetre_and_three_tenths_of_a_degree_off_the_film():
    assembly = assembled_by_hand()
    film, paper = assembly.film.registration, assembly.paper.registration
    points = np.array([[0.0, 0.0], [30.0, 10.0]])
    # where the paper's design points are found in the film's design
    paper_points = points @ paper.matrix.T + paper.shift_mm
    between = film.design_points(paper_points)
    assert np.hypot(*between[0]) == pytest.approx(0.1, rel=1e-6)
    turned = between[1] - between[0]
    angle = np.rad2deg(np.arctan2(turned[1], turned[0]) - np.arctan2(10.0, 30.0))
    assert angle == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("path", TRACED_PATHS)
@pytest.mark.parametrize("along", np.linspace(0.0, 1.0, 7))
def test_the_whole_sheet_stays_in_the_picture(path, along):
    camera = proof_camera()
    pose = pose_at(stand_on(path, along), camera, PROBE.sheet_mm)
    half = np.array(PROBE.sheet_mm) / 2
    corners = np.array([[x, y, 0.0] for x in (-half[0], half[0]) for y in (-half[1], half[1])])
    pixels = camera.project(pose, corners)
    assert np.all(pixels > 2.0)
    assert np.all(pixels < np.array(camera.image_size) - 3.0)


def test_paths_reach_the_tilts_they_are_named_for():
    tilts = {path: [stand_on(path, a).tilt_deg for a in np.linspace(0, 1, 31)] for path in TRACED_PATHS}
    assert np.ptp(tilts["orbit"]) < 4 < np.ptp(tilts["hand"])
    assert min(tilts["dive"]) == 20.0
    assert max(tilts["dive"]) == pytest.approx(60.0)
    azimuths = [stand_on("orbit", a).azimuth_deg for a in (0.0, 1.0)]
    assert np.ptp(azimuths) == pytest.approx(50.0)


def test_the_stand_is_where_the_camera_is():
    stand = stand_on("hand", 0.3)
    pose = pose_at(stand, proof_camera(), PROBE.sheet_mm)
    forward = pose.rotation[2]
    assert np.rad2deg(np.arccos(-forward[2])) == pytest.approx(stand.tilt_deg, abs=1e-6)
    assert np.rad2deg(np.arctan2(-forward[1], -forward[0])) == pytest.approx(stand.azimuth_deg, abs=1e-6)
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose.rotation) == pytest.approx(1.0)


def test_vignetting_is_one_at_the_principal_point_and_0_85_half_a_diagonal_away():
    gain = vignetting(proof_camera())
    assert gain.shape == (720, 1280)
    assert gain.max() == pytest.approx(1.0, abs=1e-6)
    assert gain.min() == pytest.approx(0.85, abs=0.01)


def test_noise_is_shot_and_read_noise():
    camera, generator = proof_camera(), np.random.default_rng(0)
    grey = np.full((720, 1280, 3), 0.4, np.float32)
    noisy, clean = (ProofSensor(noise).expose(grey, camera, generator) for noise in (True, False))
    centre = (slice(330, 380), slice(620, 670))
    assert np.std(clean[centre]) < 0.5
    encoded = np.mean(noisy[centre] / 255.0)
    slope = 1.055 / 2.4 * 0.4 ** (1 / 2.4 - 1)
    assert encoded == pytest.approx(1.055 * 0.4 ** (1 / 2.4) - 0.055, abs=2e-3)
    expected = slope * np.sqrt(0.002**2 + 0.0003 * 0.4) * 255
    assert np.std(noisy[centre].astype(float)) == pytest.approx(expected, rel=0.05)
