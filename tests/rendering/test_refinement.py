import numpy as np
import pytest
import trimesh

from arlight.rendering.default_object import default_object
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.refinement import refined


def edges_of(mesh):
    """Directed edges between places, as pairs of numbers."""
    _, place = np.unique(np.round(mesh.vertices_mm, 9), axis=0, return_inverse=True)
    faces = place.reshape(-1)[mesh.faces]
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def test_a_ball_of_few_triangles_becomes_round():
    ball = from_trimesh(trimesh.creation.icosphere(subdivisions=1))
    exact = ball.vertices_mm / np.linalg.norm(ball.vertices_mm, axis=1, keepdims=True)
    finer = refined(ball).mesh
    radius = np.linalg.norm(finer.vertices_mm, axis=1)
    flat = np.linalg.norm(ball.vertices_mm[ball.faces].mean(axis=1), axis=1)
    assert np.allclose(np.linalg.norm(exact, axis=1), 1.0)
    assert 1.0 - radius.min() < 0.1 * (1.0 - flat.min())
    assert np.sum(finer.normals * finer.vertices_mm, axis=1).min() > np.cos(np.radians(1.0)) * radius.min()


@pytest.mark.parametrize("make", [lambda: from_trimesh(trimesh.creation.box()), lambda: default_object(700)])
def test_a_closed_mesh_stays_closed(make):
    """Every edge is met once in each direction, at creases too, where vertices are split."""
    mesh = refined(make()).mesh
    edges = edges_of(mesh)
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert {tuple(edge) for edge in edges.tolist()} == {tuple(edge[::-1]) for edge in edges.tolist()}


def test_flat_faces_stay_flat_and_creases_sharp():
    box = from_trimesh(trimesh.creation.box(extents=(2.0, 3.0, 4.0)))
    finer = refined(box).mesh
    assert np.allclose(finer.extent_mm, [2.0, 3.0, 4.0])
    assert np.allclose(np.abs(finer.normals).max(axis=1), 1.0)
    corners = finer.vertices_mm[finer.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.allclose(np.abs(across).max(axis=1), np.linalg.norm(across, axis=1))


def test_what_vertices_carry_is_halfway_between():
    mesh = default_object(400)
    finer = refined(mesh)
    assert len(finer.mesh.faces) == 4 * len(mesh.faces)
    n = len(mesh.vertices_mm)
    assert np.array_equal(finer.mesh.vertices_mm[:n], mesh.vertices_mm)
    values = np.random.default_rng(2).random((n, 5)).astype(np.float32)
    carried = finer.carried(values)
    assert np.array_equal(carried[:n], values)
    np.testing.assert_allclose(carried[n:], values[finer.ends].mean(axis=1), rtol=1e-6)
    assert np.allclose(np.linalg.norm(finer.mesh.normals, axis=1), 1.0)


def test_an_edge_whose_ends_look_opposite_ways_stays_straight():
    sheet = from_trimesh(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False))
    turned = type(sheet)(
        sheet.vertices_mm, np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, 1]]), sheet.faces, sheet.base_colour
    )
    finer = refined(turned).mesh
    assert np.all(np.isfinite(finer.vertices_mm))
    assert np.all(np.isfinite(finer.normals))
    assert np.allclose(finer.vertices_mm[:, 2], 0.0)
