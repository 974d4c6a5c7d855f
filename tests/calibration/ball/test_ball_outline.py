"""The cone that touches a ball, and what its surface mirrors: checked by brute force on points of a sphere."""

import numpy as np
import pytest

from arlight.calibration.ball.ball_outline import BallError, BallOutline, MirrorGeometry, camera_rays, project_rays
from arlight.camera import Camera, Pose

BENT = Camera(
    (640, 480),
    np.array([[620.0, 0, 318.0], [0, 625.0, 243.0], [0, 0, 1]]),
    np.array([-0.22, 0.11, 2e-3, -3e-3, 0.03]),
)


def outline_of(center: np.ndarray, radius: float) -> BallOutline:
    return BallOutline(center / np.linalg.norm(center), float(np.arcsin(radius / np.linalg.norm(center))))


def sphere_points(center: np.ndarray, radius: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals all over a sphere."""
    normals = np.random.default_rng(0).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return center + radius * normals, normals


def mirrored(rays: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Rays after reflection by Householder matrices."""
    house = np.eye(3) - 2.0 * normals[:, :, None] * normals[:, None, :]
    return np.einsum("nij,nj->ni", house, rays)


@pytest.mark.parametrize("center", [(0.0, 0.0, 300.0), (90.0, -60.0, 320.0), (-130.0, 70.0, 340.0)])
def test_the_fitted_cone_is_the_balls(center):
    center = np.array(center)
    points, normals = sphere_points(center, 30.0, 4000)
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    # the contour is where the surface turns away
    distance = np.linalg.norm(center)
    tangent = np.abs(np.sum(rays * normals, axis=1)) < 0.004
    found = BallOutline.through_rays(rays[tangent])
    assert found.half_angle_rad == pytest.approx(np.arcsin(30.0 / distance), rel=1e-4)
    np.testing.assert_allclose(found.axis, center / distance, atol=1e-4)
    assert found.distance_mm(30.0) == pytest.approx(distance, rel=1e-4)


def test_a_cone_survives_the_lens():
    ball = outline_of(np.array([80.0, -50.0, 330.0]), 32.0)
    pixels = project_rays(BENT, ball.contour_rays(90))
    found = BallOutline.through_rays(camera_rays(BENT, pixels))
    np.testing.assert_allclose(found.axis, ball.axis, atol=1e-7)
    assert found.half_angle_rad == pytest.approx(ball.half_angle_rad, abs=1e-7)


def test_polar_angles_and_rays_are_inverse():
    ball = outline_of(np.array([40.0, 30.0, 200.0]), 25.0)
    away, around = np.array([0.02, 0.05, 0.1]), np.array([-2.0, 0.3, 3.0])
    back = ball.polar(ball.rays_at(away, around))
    np.testing.assert_allclose(back[0], away, atol=1e-12)
    np.testing.assert_allclose(back[1], around, atol=1e-12)


@pytest.mark.parametrize(("center", "radius"), [((20.0, -30.0, 300.0), 30.0), ((0.0, 60.0, 120.0), 50.0)])
def test_light_is_seen_where_the_sphere_reflects_it(center, radius):
    center = np.array(center)
    points, normals = sphere_points(center, radius, 20000)
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    # well inside the contour: at it a reflection is arbitrarily sensitive
    facing = -np.sum(rays * normals, axis=1) > 0.05
    rays, normals = rays[facing], normals[facing]
    light = mirrored(rays, normals)
    geometry = MirrorGeometry(outline_of(center, radius))
    found = geometry.reflections(light)
    assert found.seen.all()
    np.testing.assert_allclose(found.rays, rays, atol=2e-6)
    surface_normals, surface_light = geometry.surface(rays)
    np.testing.assert_allclose(surface_normals, normals, atol=2e-3)
    np.testing.assert_allclose(surface_light, light, atol=2e-3)


def test_only_a_cone_behind_the_ball_is_hidden():
    center, radius = np.array([0.0, 0.0, 200.0]), 50.0
    hidden = np.arcsin(radius / 200.0)
    geometry = MirrorGeometry(outline_of(center, radius))
    angles = hidden + np.array([-0.02, 0.02])
    behind = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    assert geometry.reflections(behind).seen.tolist() == [False, True]
    assert geometry.widest_rad == pytest.approx(np.pi - hidden, abs=1e-5)


def test_magnification_is_the_ratio_of_solid_angles():
    center, radius = np.array([10.0, 0.0, 250.0]), 40.0
    geometry = MirrorGeometry(outline_of(center, radius))
    light = np.array([[0.3, 0.2, -0.9], [0.8, -0.5, 0.1], [-0.5, 0.5, 0.6]])
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    step = 1e-4
    for direction, magnification in zip(light, geometry.reflections(light).magnification, strict=True):
        across = np.linalg.svd(direction[None])[2][1:]
        moved = geometry.reflections(direction + step * np.vstack([across, -across])).rays
        area = np.linalg.norm(np.cross(moved[0] - moved[2], moved[1] - moved[3])) / (2 * step) ** 2
        assert magnification == pytest.approx(area, rel=0.01)


def test_the_radius_follows_from_resting_on_a_plane():
    pose = Pose.from_rvec([2.4, 0.1, -0.2], [10.0, -20.0, 420.0])
    center = np.array([110.0, -20.0, 27.0 - 2.44])
    ball = outline_of(pose.transform(center), 27.0)
    assert ball.resting_radius_mm(pose, -2.44) == pytest.approx(27.0, rel=1e-9)


def test_a_ball_above_the_camera_rests_on_nothing():
    pose = Pose.from_rvec([np.pi, 0.0, 0.0], [0.0, 0.0, 300.0])
    upward = BallOutline(pose.rotation @ np.array([0.5, 0.0, np.sqrt(0.75)]), 0.1)
    with pytest.raises(BallError, match="cannot be a ball that rests"):
        upward.resting_radius_mm(pose, 0.0)
