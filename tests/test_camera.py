"""Projection against the pinhole and Brown's lens written out; poses against scipy's rotations."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from arlight.camera import Camera, Pose
from arlight.errors import CameraError

MATRIX = np.array([[620.0, 0, 318.0], [0, 625.0, 243.0], [0, 0, 1]])
BROWN = np.array([-0.22, 0.11, 2e-3, -3e-3, 0.03])
RATIONAL = np.array([-0.2, 0.1, 1e-3, -2e-3, 0.02, 0.05, 0.01, -0.01])
POSE = Pose.from_rvec([2.6, 0.2, -0.3], [10.0, -5.0, 420.0])


def camera_of(distortion=(), matrix=MATRIX):
    return Camera((640, 480), matrix, np.asarray(distortion, float))


def by_hand(matrix, distortion, pose, points):
    """Pixels after Brown and Conrady, with OpenCV's order of the terms."""
    seen = np.array([pose.rotation @ point + pose.translation for point in points])
    x, y = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2]
    k1, k2, p1, p2, k3, k4, k5, k6 = np.concatenate([distortion, np.zeros(8 - len(distortion))])
    r = x**2 + y**2
    radial = (1 + k1 * r + k2 * r**2 + k3 * r**3) / (1 + k4 * r + k5 * r**2 + k6 * r**3)
    u = x * radial + 2 * p1 * x * y + p2 * (r + 2 * x**2)
    v = y * radial + p1 * (r + 2 * y**2) + 2 * p2 * x * y
    return np.stack([matrix[0, 0] * u + matrix[0, 2], matrix[1, 1] * v + matrix[1, 2]], axis=1)


@pytest.mark.parametrize("distortion", [(), np.zeros(5), BROWN[:4], BROWN, RATIONAL], ids=len)
def test_projection_is_the_pinhole_behind_its_lens(distortion):
    points = np.random.default_rng(0).uniform(-80, 80, (50, 3)) * [1, 1, 0.2]
    found = camera_of(distortion).project(POSE, points)
    np.testing.assert_allclose(found, by_hand(MATRIX, np.asarray(distortion, float), POSE, points), atol=1e-9)


@pytest.mark.parametrize("distortion", [(), BROWN, RATIONAL], ids=len)
def test_rays_lead_back_to_the_pixels(distortion):
    camera = camera_of(distortion)
    pixels = np.random.default_rng(1).uniform([0, 0], [639, 479], (100, 2))
    ahead = np.column_stack([camera.rays(pixels), np.ones(100)])
    still = Pose(np.eye(3), np.zeros(3))
    np.testing.assert_allclose(by_hand(MATRIX, np.asarray(distortion, float), still, ahead), pixels, atol=1e-5)
    np.testing.assert_allclose(camera.project(still, ahead), pixels, atol=1e-5)


@pytest.mark.parametrize("distortion", [(), BROWN], ids=len)
def test_ray_map_holds_the_ray_of_every_pixels_centre(distortion):
    camera = Camera((32, 20), np.array([[40.0, 0, 15], [0, 41, 9], [0, 0, 1]]), np.asarray(distortion, float))
    assert camera.ray_map.shape == (20, 32, 2)
    for column, row in [(0, 0), (31, 0), (0, 19), (15, 9)]:
        np.testing.assert_allclose(camera.ray_map[row, column], camera.rays([[column, row]])[0], atol=1e-6)
    np.testing.assert_allclose(camera.ray_map[9, 15], [0, 0], atol=1e-6)
    assert camera.ray_map is camera.ray_map


@pytest.mark.parametrize("distortion", [(), BROWN, RATIONAL], ids=len)
def test_a_saved_camera_is_loaded_unchanged(tmp_path, distortion):
    camera = camera_of(distortion)
    camera.save(tmp_path / "camera.json")
    loaded = Camera.load(tmp_path / "camera.json")
    assert loaded.image_size == (640, 480)
    np.testing.assert_array_equal(loaded.camera_matrix, camera.camera_matrix)
    np.testing.assert_array_equal(loaded.distortion, camera.distortion)


def test_distortion_may_be_left_out(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({"image_size": [640, 480], "camera_matrix": MATRIX.tolist()}))
    assert not np.any(Camera.load(path).distortion)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"image_size": [640]}, "image_size"),
        ({"image_size": [640, 0]}, "image_size"),
        ({"image_size": ["a", "b"]}, "image_size"),
        ({"image_size": None}, "image_size"),
        ({"camera_matrix": [[1, 0], [0, 1]]}, "3x3"),
        ({"camera_matrix": [[620, 0, 318], [0, float("nan"), 243], [0, 0, 1]]}, "finite"),
        ({"camera_matrix": [[620, 0, 318], [0, -625, 243], [0, 0, 1]]}, "positive focal"),
        ({"camera_matrix": [[620, 0, 318], [0, 625, 243], [0, 0, 2]]}, "last row"),
        ({"camera_matrix": [[620, 1.5, 318], [0, 625, 243], [0, 0, 1]]}, "skew, found 1.5"),
        ({"camera_matrix": [[620, 0, 318], [1.5, 625, 243], [0, 0, 1]]}, "skew"),
        ({"camera_matrix": "none"}, "camera_matrix"),
        ({"distortion": [0.1, 0.2, 0.3]}, "distortion must hold"),
        ({"distortion": [0.1, 0.2, 0, 0, float("inf")]}, "distortion must hold"),
    ],
)
def test_impossible_cameras_are_refused_with_the_files_name(tmp_path, change, message):
    path = tmp_path / "broken.json"
    content = {"image_size": [640, 480], "camera_matrix": MATRIX.tolist(), "distortion": [0.0] * 5}
    path.write_text(json.dumps(content | change))
    with pytest.raises(CameraError, match=message) as refusal:
        Camera.load(path)
    assert "broken.json" in str(refusal.value)


@pytest.mark.parametrize("content", [b"", b"{", b"[1, 2]", b"7", b"{}", b"\xff\xfe\x00"])
def test_files_that_are_no_camera_are_refused(tmp_path, content):
    path = tmp_path / "camera.json"
    path.write_bytes(content)
    with pytest.raises(CameraError, match=r"camera\.json: expected JSON with image_size"):
        Camera.load(path)


def test_a_missing_camera_is_refused(tmp_path):
    with pytest.raises(CameraError, match=r"nowhere\.json: cannot be read"):
        Camera.load(tmp_path / "nowhere.json")
    with pytest.raises(CameraError, match="cannot be read"):
        Camera.load(tmp_path)


@pytest.mark.parametrize("rvec", [[0, 0, 0], [1e-9, 0, 0], [0.3, -1.2, 2.0], [np.pi, 0, 0], [3.0, 0.2, -0.3]])
def test_rotation_vectors_are_those_of_scipy(rvec):
    pose = Pose.from_rvec(rvec, [1, 2, 3])
    np.testing.assert_allclose(pose.rotation, Rotation.from_rotvec(rvec).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(Pose.from_rvec(pose.rvec, pose.translation).rotation, pose.rotation, atol=1e-9)


def test_a_pose_is_a_rigid_motion():
    points = np.random.default_rng(2).normal(size=(4, 5, 3)) * 50
    moved = POSE.transform(points)
    assert moved.shape == points.shape
    expected = Rotation.from_rotvec([2.6, 0.2, -0.3]).apply(points.reshape(-1, 3)) + [10, -5, 420]
    np.testing.assert_allclose(moved.reshape(-1, 3), expected, atol=1e-9)
    np.testing.assert_allclose(POSE.transform([0, 0, 0]), POSE.translation)


def test_the_camera_is_at_its_own_origin():
    np.testing.assert_allclose(POSE.transform(POSE.camera_centre_mm), 0, atol=1e-9)


def test_view_directions_lead_to_the_camera():
    points = np.random.default_rng(3).uniform(-80, 80, (3, 7, 3))
    toward = POSE.view_directions(points)
    np.testing.assert_allclose(np.linalg.norm(toward, axis=-1), 1, atol=1e-12)
    distance = np.linalg.norm(POSE.transform(points), axis=-1)
    expected = np.broadcast_to(POSE.camera_centre_mm, points.shape)
    np.testing.assert_allclose(points + distance[..., None] * toward, expected, atol=1e-9)


def test_gain_falls_off_from_the_principal_point_in_half_diagonals():
    matrix = np.array([[500.0, 0, 300.0], [0, 500.0, 200.0], [0, 0, 1]])
    camera = Camera((600, 800), matrix, np.zeros(5), (-0.3, 0.1, -0.02))
    # half of the diagonal of 600 x 800 is 500: these lie 0, 1/2 and 1 of it away
    found = camera.gain([[300, 200], [300, 450], [600, 600]])
    np.testing.assert_allclose(found, [1.0, 1 - 0.3 / 4 + 0.1 / 16 - 0.02 / 64, 1 - 0.3 + 0.1 - 0.02], rtol=1e-12)


def test_a_camera_without_vignetting_has_an_even_gain():
    np.testing.assert_array_equal(camera_of(BROWN).gain([[0, 0], [639, 479]]), [1.0, 1.0])


def test_vignetting_is_saved_where_there_is_some(tmp_path):
    Camera((640, 480), MATRIX, BROWN, (-0.3, 0.1, -0.02)).save(tmp_path / "camera.json")
    assert Camera.load(tmp_path / "camera.json").vignetting == (-0.3, 0.1, -0.02)
    camera_of(BROWN).save(tmp_path / "plain.json")
    assert "vignetting" not in json.loads((tmp_path / "plain.json").read_text())
    assert Camera.load(tmp_path / "plain.json").vignetting is None


@pytest.mark.parametrize("vignetting", [(0.1, 0.2), (np.nan, 0, 0), (-2.0, 0, 0), "none", (1, 2, 3, 4)], ids=str)
def test_impossible_vignetting_is_refused(tmp_path, vignetting):
    path = tmp_path / "camera.json"
    content = {"image_size": [640, 480], "camera_matrix": MATRIX.tolist(), "vignetting": vignetting}
    path.write_text(json.dumps(content))
    with pytest.raises(CameraError, match=r"camera\.json"):
        Camera.load(path)


def test_vignetting_is_added_to_the_cameras_own():
    plain = Camera((64, 48), [[60.0, 0, 31.5], [0, 60, 23.5], [0, 0, 1]], np.zeros(5))
    assert plain.with_more_vignetting((0.0, 0.0, 0.0)) is plain
    once = plain.with_more_vignetting((-0.1, 0.02, 0.0))
    twice = once.with_more_vignetting((-0.05, 0.0, 0.01))
    np.testing.assert_allclose(twice.vignetting, (-0.15, 0.02, 0.01))
    pixels = np.array([[0.0, 0.0], [50.0, 10.0]])
    np.testing.assert_allclose(
        twice.gain(pixels) - once.gain(pixels), plain.with_more_vignetting((-0.05, 0, 0.01)).gain(pixels) - 1
    )
