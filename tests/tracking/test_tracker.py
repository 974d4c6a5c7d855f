import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.color import linear_from_encoded
from arlight.errors import CameraError
from arlight.tracking.tracker import PoseTracker, predict

RATE = 30.0


@pytest.mark.parametrize("lens", ["camera", "bent_camera"])
@pytest.mark.parametrize(("tilt", "distance"), [(0.0, 300), (0.5, 500), (30.0, 330), (65.0, 330), (75.0, 300)])
def test_it_finds_the_sheet_in_one_frame(sheet, look, photograph, pose_error_px, request, lens, tilt, distance) -> None:
    camera = request.getfixturevalue(lens)
    truth = look(tilt, 70 + tilt, distance, -50, (4, 2))
    found = PoseTracker(sheet, camera).update(photograph(camera, truth), 0.0)
    assert found.status == "tracked"
    error, offset = pose_error_px(camera, found.camera_from_probe, truth)
    assert error < 0.05
    assert np.max(np.abs(offset)) < 0.03
    assert found.reprojection_rms_px < 0.15
    assert found.markers_used == 8
    assert 0.2 < found.blur_px < 0.8


def test_both_hypotheses_near_the_normal(sheet, camera, look, photograph) -> None:
    # Far off and hardly tilted, the mirrored pose reprojects to within a fraction of a pixel.
    for tilt in (3.0, 8.0, 15.0):
        truth = look(tilt, 200, 800)
        found = PoseTracker(sheet, camera).update(photograph(camera, truth, noise=0.002), 0.0)
        # sin(angle / 2) from the chord between the rotations.
        chord = np.linalg.norm(found.camera_from_probe.rotation - truth.rotation) / np.sqrt(8)
        assert np.degrees(2 * np.arcsin(chord)) < 0.5, tilt


@pytest.mark.parametrize("levels", [1, 3])
def test_it_follows_fast_motion(sheet, camera, look, photograph, pose_error_px, levels) -> None:
    tracker, before, fastest = PoseTracker(sheet, camera, levels), None, 0.0
    for k in range(11):
        swing = np.sin(k * 0.33)
        truth = look(35 + 10 * swing, 60 + 4 * k, 420 + 20 * swing, 3 * k, (50 * swing, 30 * np.cos(k * 0.25)))
        found = tracker.update(photograph(camera, truth, seed=k, across=3), k / RATE)
        assert found.status == "tracked", k
        assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 0.06, k
        if before is not None:
            fastest = max(fastest, pose_error_px(camera, before, truth)[0])
        before = truth
    assert fastest > 15.0


def test_a_jump_loses_no_marker(sheet, camera, look, photograph, pose_error_px) -> None:
    # the longer ones are too far for the finest resolution, where single markers may still fit by chance
    tracker, pose = PoseTracker(sheet, camera), look(30, 100, 300)
    for k in range(2):
        tracker.update(photograph(camera, pose, seed=k, across=3), k / RATE)
    mm_per_px = 300 / camera.camera_matrix[0, 0]
    for k, jump_px in enumerate([(1, 0), (0, 4), (-4, 0), (4, -6)]):
        truth = Pose(pose.rotation, pose.translation + mm_per_px * np.array([*jump_px, 0.0]))
        found = tracker.update(photograph(camera, truth, seed=k, across=3), (2 + k) / RATE)
        assert found.markers_used == 8
        assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 0.06


@pytest.mark.parametrize("levels", [0, 5])
def test_a_number_of_levels_that_there_is_not_is_refused(sheet, camera, levels) -> None:
    with pytest.raises(ValueError, match="alignment_levels must be 1 to 4"):
        PoseTracker(sheet, camera, levels)


def test_sharp_shadows_do_not_lose_it(sheet, camera, look, photograph, pose_error_px) -> None:
    tracker, truth, errors = PoseTracker(sheet, camera), look(35, 200, 320, 10), []
    for k in range(-70, 75, 16):
        shadow = lambda x, y, edge=k: np.where(x + 0.4 * y < edge, 0.2, 1.0)  # noqa: E731
        found = tracker.update(photograph(camera, truth, light=shadow, seed=k + 70, across=3), k / RATE)
        assert found.status == "tracked", k
        errors.append(pose_error_px(camera, found.camera_from_probe, truth)[0])
    assert max(errors) < 0.1
    assert np.median(errors) < 0.05


def test_a_shadow_as_first_sight(sheet, camera, look, photograph, pose_error_px) -> None:
    truth = look(35, 200, 320, 10)
    picture = photograph(camera, truth, light=lambda x, y: np.where(x - y < 10, 0.15, 1.0))
    found = PoseTracker(sheet, camera).update(picture, 0.0)
    assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 0.1


def test_a_hand_over_most_markers(sheet, camera, look, photograph, pose_error_px) -> None:
    tracker = PoseTracker(sheet, camera)
    for k, edge in enumerate((640, 420, 300, 270)):
        truth = look(30, 90 + k, 300, 0)

        def hand(linear: np.ndarray, edge=edge) -> np.ndarray:
            linear[:, edge:] = 0.35 + 0.1 * np.sin(np.arange(480) / 9.0)[:, None]
            return linear

        found = tracker.update(photograph(camera, truth, cover=hand, seed=k), k / RATE)
        assert found.status == "tracked", k
        assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 0.2, k
    assert found.markers_used <= 3


def test_it_leaves_and_returns(sheet, camera, look, photograph, pose_error_px) -> None:
    tracker, states = PoseTracker(sheet, camera), []
    for k, off in enumerate((0, 60, 120, 180, 300, 300, 170, 40)):
        truth = look(30, 90, 330, 0, (-off, 0.0))
        found = tracker.update(photograph(camera, truth, seed=k), k / RATE)
        states.append(found.status)
        if found.status == "tracked":
            # With few markers left in view, the far side of the sheet is extrapolated.
            assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 1.0, k
        else:
            assert found.camera_from_probe is None
            assert np.isnan(found.reprojection_rms_px)
    assert states[:3] == ["tracked"] * 3
    assert states[4:6] == ["lost"] * 2
    assert states[-1] == "tracked"


@pytest.mark.parametrize("empty", ["black", "white", "noise"])
def test_frames_without_the_sheet(sheet, camera, look, photograph, pose_error_px, empty) -> None:
    blank = {
        "black": np.zeros((480, 640), np.uint8),
        "white": np.full((480, 640), 255, np.uint8),
        "noise": np.random.default_rng(1).integers(0, 256, (480, 640), dtype=np.uint8),
    }[empty]
    tracker, truth = PoseTracker(sheet, camera), look(40, 10, 320)
    picture = photograph(camera, truth)
    assert tracker.update(blank, 0.0).status == "lost"
    assert tracker.update(picture, 0.1).status == "tracked"
    assert [tracker.update(blank, 0.2 + k).status for k in range(4)] == ["lost"] * 4
    # After long losses one resolution a frame is searched: it may take some frames to find the sheet again.
    states = [tracker.update(picture, 5.0 + k / RATE) for k in range(3)]
    assert states[-1].status == "tracked"
    assert pose_error_px(camera, states[-1].camera_from_probe, truth)[0] < 0.04


def test_only_the_sheet_s_surroundings_matter(sheet, camera, look, photograph) -> None:
    truth, other = look(40, 10, 520), look(41, 12, 520, 1)
    first, second = photograph(camera, truth), photograph(camera, other)
    scribbled = second.copy()
    scribbled[:40], scribbled[-40:], scribbled[:, :80], scribbled[:, -80:] = 255, 0, 90, 17
    poses = []
    for picture in (second, scribbled):
        tracker = PoseTracker(sheet, camera)
        tracker.update(first, 0.0)
        poses.append(tracker.update(picture, 1 / RATE).camera_from_probe)
    np.testing.assert_array_equal(poses[0].rotation, poses[1].rotation)
    np.testing.assert_array_equal(poses[0].translation, poses[1].translation)


def test_a_second_copy_of_a_marker_in_view(sheet, camera, look, photograph, pose_error_px) -> None:
    truth = look(30, 10, 420, 0, (-25, 0))
    picture = photograph(camera, truth)
    corners = camera.project(truth, np.column_stack([sheet.markers[2].corners_mm, np.zeros(4)]))
    (x0, y0), (x1, y1) = np.floor(corners.min(axis=0)).astype(int) - 4, np.ceil(corners.max(axis=0)).astype(int) + 4
    picture[5 : 5 + y1 - y0, 5 : 5 + x1 - x0] = picture[y0:y1, x0:x1]
    found = PoseTracker(sheet, camera).update(picture, 0.0)
    assert found.markers_used == 8
    assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 0.05


def test_motion_blur(sheet, camera, look, photograph, pose_error_px) -> None:
    truth = look(30, 10, 320)
    smear = lambda linear: sum(np.roll(linear, k, axis=1) for k in range(-3, 4)) / 7.0  # noqa: E731
    tracker = PoseTracker(sheet, camera)
    tracker.update(photograph(camera, truth), 0.0)
    found = tracker.update(photograph(camera, truth, cover=smear), 1 / RATE)
    assert found.status == "tracked"
    assert pose_error_px(camera, found.camera_from_probe, truth)[0] < 0.06


def test_codes_of_any_range_give_the_same_pose(sheet, camera, look, photograph, pose_error_px) -> None:
    picture = photograph(camera, look(40, 10, 320))
    limited = np.round(16 + picture * (219 / 255)).astype(np.uint8)
    limited.flags.writeable = False
    table = linear_from_encoded((np.arange(256) - 16) / 219)
    table.flags.writeable = False
    full = PoseTracker(sheet, camera).update(picture, 0.0)
    other = PoseTracker(sheet, camera).update(limited, 0.0, table)
    assert pose_error_px(camera, full.camera_from_probe, other.camera_from_probe)[0] < 0.01


def test_codes_of_ten_bits(sheet, camera, look, photograph, pose_error_px) -> None:
    picture = photograph(camera, look(40, 10, 320))
    table = linear_from_encoded((np.arange(1024) - 64) / 876)
    deep = np.round(64 + picture * (876 / 255)).astype(np.uint16)
    full = PoseTracker(sheet, camera).update(picture, 0.0)
    other = PoseTracker(sheet, camera).update(deep, 0.0, table)
    assert pose_error_px(camera, full.camera_from_probe, other.camera_from_probe)[0] < 0.005


def test_reset_and_strided_frames(sheet, camera, look, photograph) -> None:
    pictures = [photograph(camera, look(40, 10 + k, 320)) for k in range(3)]
    tracker = PoseTracker(sheet, camera)
    first = [tracker.update(picture, k / RATE) for k, picture in enumerate(pictures)]
    tracker.reset()
    padded = [np.pad(picture, ((0, 0), (0, 32)))[:, :640] for picture in pictures]
    second = [tracker.update(picture, k / RATE) for k, picture in enumerate(padded)]
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.camera_from_probe.rotation, b.camera_from_probe.rotation)
        assert a.blur_px == b.blur_px


@pytest.mark.parametrize("shape", [(480, 641), (640, 480), (1, 1), (480, 640, 3)])
def test_a_frame_of_another_size_is_refused(sheet, camera, shape) -> None:
    with pytest.raises(CameraError, match=r"640x480.*camera\.json"):
        PoseTracker(sheet, camera).update(np.zeros(shape, np.uint8), 0.0)


@pytest.mark.parametrize("size", [(1, 1), (3, 200), (16, 16), (47, 33)])
def test_tiny_frames_hold_no_sheet(sheet, size) -> None:
    camera = Camera(size, np.array([[50.0, 0, 8], [0, 50, 8], [0, 0, 1]]), np.zeros(5))
    frame = np.random.default_rng(0).integers(0, 255, size[::-1], dtype=np.uint8)
    tracker = PoseTracker(sheet, camera)
    assert [tracker.update(frame, float(k)).status for k in range(4)] == ["lost"] * 4


def test_prediction_continues_a_uniform_motion(look) -> None:
    turn = Pose.from_rvec([0.05, -0.02, 0.08], np.zeros(3)).rotation
    shift = np.array([3.0, -1.0, 2.0])
    poses = [look(30, 10, 300)]
    for _ in range(3):
        poses.append(Pose(turn @ poses[-1].rotation, poses[-1].translation + shift))
    ahead = predict(poses[0], 1.0, poses[1], 1.1, 1.3)
    np.testing.assert_allclose(ahead.rotation, poses[3].rotation, atol=1e-12)
    np.testing.assert_allclose(ahead.translation, poses[3].translation, atol=1e-12)
    half = predict(poses[0], 1.0, poses[2], 1.2, 1.3)
    np.testing.assert_allclose(half.rotation, poses[3].rotation, atol=1e-12)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 1.0, 3.1])
def test_prediction_turns_by_a_share_of_any_angle(look, angle) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    before = look(30, 10, 300)
    last, ahead = (
        Pose(Pose.from_rvec(share * angle * axis, np.zeros(3)).rotation @ before.rotation, before.translation)
        for share in (1.0, 1.5)
    )
    np.testing.assert_allclose(predict(before, 1.0, last, 1.2, 1.3).rotation, ahead.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("before_s", "last_s", "time_s"), [(1.0, 1.0, 2.0), (1.0, 2.0, 2.0), (1.0, 2.0, 0.5), (3.0, 2.0, 4.0)]
)
def test_no_motion_when_time_stands_still_or_runs_back(look, before_s, last_s, time_s) -> None:
    before, last = look(30, 10, 300), look(35, 20, 310)
    ahead = predict(before, before_s, last, last_s, time_s)
    np.testing.assert_allclose(ahead.rotation, last.rotation, atol=1e-12)
    np.testing.assert_allclose(ahead.translation, last.translation, atol=1e-12)
