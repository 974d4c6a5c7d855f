import dataclasses

import numpy as np
import pytest

from arlight.camera import Pose
from arlight.tracking.fiducials import Detection
from arlight.tracking.planar_pose import is_seen_from_above, planar_poses, poses_from_detections


def seen(camera, sheet, pose, noise_px=0.0, seed=0) -> list[Detection]:
    rng = np.random.default_rng(seed)
    detections = []
    for marker in sheet.markers:
        corners = camera.project(pose, np.column_stack([marker.corners_mm, np.zeros(4)]))
        detections.append(Detection(marker.id, corners + noise_px * rng.normal(size=(4, 2))))
    return detections


@pytest.mark.parametrize("tilt", [0.0, 1.0, 30.0, 60.0, 80.0])
def test_exact_corners_give_the_exact_pose(sheet, bent_camera, look, tilt) -> None:
    truth = look(tilt, 130, 420, -35, (15, -8))
    best = poses_from_detections(bent_camera, sheet, seen(bent_camera, sheet, truth))[0]
    np.testing.assert_allclose(best.pose.rotation, truth.rotation, atol=1e-6)
    np.testing.assert_allclose(best.pose.translation, truth.translation, rtol=1e-6, atol=1e-4)
    assert best.markers == 8
    assert best.rms_px < 1e-4


def test_the_second_hypothesis_leans_the_other_way(sheet, camera, look) -> None:
    truth = look(50, 90, 2500)
    first, second = poses_from_detections(camera, sheet, seen(camera, sheet, truth))
    assert first.rms_px < second.rms_px
    np.testing.assert_allclose(first.pose.rotation, truth.rotation, atol=1e-5)
    # The plane's normal is mirrored at the line of sight; the picture hardly differs from so far away.
    normal, mirrored = first.pose.rotation[:, 2], second.pose.rotation[:, 2]
    sight = truth.translation / np.linalg.norm(truth.translation)
    np.testing.assert_allclose(mirrored, 2 * np.dot(normal, sight) * sight - normal, atol=0.02)
    assert 0.1 < second.rms_px < 1.0


def test_refinement_that_leads_to_one_pose_leaves_one(sheet, camera, look) -> None:
    hypotheses = poses_from_detections(camera, sheet, seen(camera, sheet, look(4, 90, 300)))
    assert len(hypotheses) == 1


def test_a_second_copy_and_a_false_detection_are_left_out(sheet, camera, look) -> None:
    truth = look(40, 10, 330)
    corners = seen(camera, sheet, truth, 0.2)
    elsewhere = Detection(3, corners[3].corners_px * 0.4 + 5.0)
    swapped = dataclasses.replace(corners[5], corners_px=np.roll(corners[5].corners_px, 1, axis=0) + 40.0)
    wrong = [elsewhere, *corners[:5], swapped, *corners[6:]]
    best = poses_from_detections(camera, sheet, wrong)[0]
    assert best.markers == 7
    assert best.rms_px < 0.4
    np.testing.assert_allclose(best.pose.rotation, truth.rotation, atol=0.01)


def test_turning_the_sheet_s_own_axes_turns_the_pose(sheet, camera, look) -> None:
    corners = seen(camera, sheet, look(50, 200, 400), 0.3)
    turned = dataclasses.replace(
        sheet,
        markers=tuple(
            dataclasses.replace(m, corners_mm=tuple((-y, x) for x, y in m.corners_mm)) for m in sheet.markers
        ),
    )
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    plain, other = (poses_from_detections(camera, probe, corners)[0] for probe in (sheet, turned))
    np.testing.assert_allclose(other.pose.rotation @ quarter, plain.pose.rotation, atol=1e-6)
    np.testing.assert_allclose(other.pose.translation, plain.pose.translation, atol=1e-4)


def test_the_order_of_the_detections_does_not_matter(sheet, camera, look) -> None:
    corners = seen(camera, sheet, look(50, 200, 400), 0.3)
    forward, backward = (poses_from_detections(camera, sheet, c)[0] for c in (corners, corners[::-1]))
    np.testing.assert_allclose(forward.pose.translation, backward.pose.translation, atol=1e-4)


@pytest.mark.parametrize(
    "points", [np.zeros((4, 2)), np.column_stack([np.arange(6.0), np.zeros(6)]), np.zeros((0, 2)), np.eye(3)[:, :2]]
)
def test_degenerate_points_give_finite_poses_or_none(camera, points) -> None:
    pixels = np.random.default_rng(0).uniform(0, 400, (len(points), 2))
    for hypothesis in planar_poses(camera, points, pixels):
        assert np.all(np.isfinite(hypothesis.pose.translation))


def test_no_detections_no_pose(camera, sheet) -> None:
    assert poses_from_detections(camera, sheet, []) == []


def test_seen_from_above() -> None:
    sheet = np.array([[-80.0, -80, 0], [80, 80, 0]])
    facing = np.diag([1.0, -1.0, -1.0])
    assert is_seen_from_above(Pose(facing, np.array([0.0, 0, 300])), sheet)
    assert not is_seen_from_above(Pose(np.eye(3), np.array([0.0, 0, 300])), sheet)
    assert not is_seen_from_above(Pose(facing, np.array([0.0, 0, -300])), sheet)
    assert not is_seen_from_above(Pose(facing, np.array([np.nan, 0, 300])), sheet)
