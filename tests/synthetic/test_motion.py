"""Paths keep the sheet in the picture, go where they say and move smoothly."""

import numpy as np
import pytest

from arlight.errors import ArlightError
from arlight.synthetic.motion import PATHS, CameraMotion
from arlight.synthetic.settings import default_camera

CAMERA = default_camera()
SHEET_MM = (190.0, 226.0)
TIMES = np.linspace(0.0, 5.0, 26)


def outline_px(pose, sheet_mm=SHEET_MM):
    x, y = np.array(sheet_mm) / 2
    return CAMERA.project(pose, np.array([[-x, y, 0], [x, y, 0], [x, -y, 0], [-x, -y, 0]]))


def tilts_deg(motion):
    poses = [motion.pose(t, CAMERA, SHEET_MM) for t in TIMES]
    return np.array([np.rad2deg(np.arccos(pose.view_directions(np.zeros(3))[2])) for pose in poses])


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("width", [300.0, 700.0])
def test_sheet_stays_in_the_picture(path, width):
    motion = CameraMotion(path, width)
    for time_s in TIMES:
        pose = motion.pose(time_s, CAMERA, SHEET_MM)
        corners = outline_px(pose)
        assert np.all(corners >= 2.0)
        assert np.all(corners <= np.array(CAMERA.image_size) - 3.0)
        np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
        assert pose.camera_centre_mm[2] > 0.0


@pytest.mark.parametrize("tilt", [0.0, 15.0, 35.0, 55.0, 70.0])
@pytest.mark.parametrize("width", [300.0, 450.0])
def test_still_stands_at_the_tilt_and_width_asked_for(tilt, width):
    pose = CameraMotion("still", width, tilt).pose(0.0, CAMERA, (160.0, 160.0))
    # the aim is not the sheet's centre: what is measured there differs a little
    assert np.rad2deg(np.arccos(pose.view_directions(np.zeros(3))[2])) == pytest.approx(tilt, abs=1e-6)
    across = CAMERA.project(pose, np.array([[-80.0, 0, 0], [80.0, 0, 0]]))
    assert np.linalg.norm(across[1] - across[0]) == pytest.approx(width, rel=0.02)


def test_upright_picture():
    corners = outline_px(CameraMotion("still").pose(0.0, CAMERA, SHEET_MM))
    assert corners[0, 0] < corners[1, 0]
    assert corners[0, 1] < corners[3, 1]


@pytest.mark.parametrize(("path", "low", "high"), [("orbit", 35.0, 55.0), ("low", 60.0, 70.0)])
def test_paths_cover_the_angles_they_promise(path, low, high):
    tilts = tilts_deg(CameraMotion(path))
    assert tilts.min() == pytest.approx(low, abs=1.0)
    assert tilts.max() == pytest.approx(high, abs=1.0)


def test_orbit_goes_round_the_sheet():
    poses = [CameraMotion("orbit").pose(t, CAMERA, SHEET_MM) for t in TIMES]
    azimuths = np.array([np.arctan2(p.camera_centre_mm[1], p.camera_centre_mm[0]) for p in poses])
    assert np.ptp(np.rad2deg(azimuths)) > 40.0


def test_approach_comes_closer():
    motion = CameraMotion("approach")
    distances = [np.linalg.norm(motion.pose(t, CAMERA, SHEET_MM).camera_centre_mm) for t in TIMES]
    assert np.all(np.diff(distances) <= 1e-9)
    assert distances[-1] < 0.6 * distances[0]


@pytest.mark.parametrize("path", PATHS)
def test_motion_is_smooth_at_25_frames_a_second(path):
    motion = CameraMotion(path)
    corners = np.array([outline_px(motion.pose(i / 25, CAMERA, SHEET_MM)) for i in range(50)])
    speed = np.linalg.norm(np.diff(corners, axis=0), axis=-1)
    assert speed.max() < 12.0
    assert (speed.max() > 0.0) == (path != "still")


def test_shake_depends_on_the_seed_only():
    one, same, other = (CameraMotion("handheld", seed=s).pose(1.0, CAMERA, SHEET_MM) for s in (1, 1, 2))
    np.testing.assert_array_equal(one.rotation, same.rotation)
    assert np.any(one.rotation != other.rotation)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"path": "loop"}, "orbit"),
        ({"tilt_deg": 95.0}, "95"),
        ({"sheet_width_px": 3.0}, "at least 20"),
        ({"duration_s": 0.0}, "positive"),
    ],
)
def test_impossible_motion_is_refused(wrong, message):
    with pytest.raises(ArlightError, match=message):
        CameraMotion(**wrong)
