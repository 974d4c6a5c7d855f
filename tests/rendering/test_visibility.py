import numpy as np
import pytest
import trimesh

from arlight.estimation.radiance_prior import hemisphere_points
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.visibility import surface_offset_mm, visibility

pytestmark = pytest.mark.usefixtures("gl")


def test_a_ball_hides_what_rays_through_it_would_meet():
    ball = from_trimesh(trimesh.creation.icosphere(subdivisions=4)).placed(20.0)
    centre = np.array([0.0, 0.0, 10.0])
    rng = np.random.default_rng(3)
    points = rng.uniform([-40, -40, 0], [40, 40, 40], (400, 3))
    points = points[np.linalg.norm(points - centre, axis=1) > 11.0]
    directions = hemisphere_points(60)
    toward = centre - points
    along = np.einsum("pc,dc->dp", toward, directions)
    distance = np.sqrt(np.maximum(np.sum(toward**2, axis=1) - along**2, 0.0))
    seen = visibility(ball, points, directions)
    clear_cut = np.abs(distance - 10.0) > 0.4  # outline: two texels of the map
    expected = np.where((distance < 10.0) & (along > 0.0), 0, 255)
    assert np.array_equal(seen[clear_cut], expected[clear_cut])


def test_a_convex_surface_does_not_hide_itself():
    ball = from_trimesh(trimesh.creation.icosphere(subdivisions=4)).placed(20.0)
    directions = hemisphere_points(100)
    seen = visibility(ball, ball.vertices_mm + ball.normals * surface_offset_mm(ball), directions)
    facing = directions @ ball.normals.T > 0.02
    assert seen[facing].mean() > 254.0
    assert seen[directions @ ball.normals.T < -0.2].mean() < 1.0


def test_progress_runs_to_one():
    ball = from_trimesh(trimesh.creation.icosphere(subdivisions=1)).placed(20.0)
    shares = []
    visibility(ball, ball.vertices_mm, hemisphere_points(300), shares.append)
    assert len(shares) > 1
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


@pytest.mark.parametrize("count", [1, 64, 150])
def test_every_direction_is_seen_for_itself(count):
    ball = from_trimesh(trimesh.creation.icosphere(subdivisions=2)).placed(20.0)
    points = np.random.default_rng(5).uniform([-30, -30, 0], [30, 30, 30], (50, 3))
    directions = np.concatenate([hemisphere_points(count), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]])
    together = visibility(ball, points, directions)
    alone = [visibility(ball, points, direction[None])[0] for direction in directions]
    assert np.array_equal(together, alone)
