from dataclasses import replace

import numpy as np
import pytest
import trimesh

from arlight.errors import MeshError
from arlight.rendering.default_object import default_object
from arlight.rendering.mesh import Mesh, joined, smooth_normals
from arlight.rendering.mesh_file import from_trimesh


def triangle(vertices):
    vertices = np.asarray(vertices, float)
    normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    return Mesh(vertices, normals, np.array([[0, 1, 2]], np.int32), np.ones((len(vertices), 3), np.float32))


def test_placed_scales_turns_and_rests_on_the_sheet():
    mesh = from_trimesh(trimesh.creation.box(extents=(4.0, 2.0, 1.0))).placed(80.0, (5.0, -7.0), 90.0)
    assert np.allclose(mesh.extent_mm, [40.0, 80.0, 20.0])
    assert mesh.vertices_mm[:, 2].min() == pytest.approx(0.0)
    assert np.allclose((mesh.vertices_mm.min(axis=0) + mesh.vertices_mm.max(axis=0))[:2] / 2, [5.0, -7.0])


def test_yaw_is_counter_clockwise_from_above():
    mesh = triangle([[0, 0, 0], [3, 0, 0], [0, 1, 0]]).placed(3.0, yaw_deg=90.0)
    along = mesh.vertices_mm[1] - mesh.vertices_mm[0]
    assert np.allclose(along, [0.0, 3.0, 0.0])


def test_bounding_sphere_holds_every_vertex():
    mesh = default_object().placed(60.0, (10.0, 3.0), 20.0)
    centre, radius = mesh.bounding_sphere_mm
    assert np.linalg.norm(mesh.vertices_mm - centre, axis=1).max() < radius


def test_default_object_is_closed_outward_and_always_the_same():
    mesh, again = default_object(), default_object()
    assert np.array_equal(mesh.vertices_mm, again.vertices_mm)
    assert mesh.closed
    corners = mesh.vertices_mm[mesh.faces]
    assert np.sum(np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]) > 0
    faces_normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.sum(faces_normal * mesh.normals[mesh.faces].mean(axis=1), axis=1) > 0)
    assert mesh.base_colour.min() > 0
    assert mesh.base_colour.max() < 1


def test_smooth_normals_of_a_sphere_point_outward():
    ball = trimesh.creation.icosphere(subdivisions=3)
    normals = smooth_normals(np.asarray(ball.vertices), np.asarray(ball.faces, np.int32))
    assert np.sum(normals * ball.vertices, axis=1).min() > np.cos(np.radians(1.0))


def test_joined_keeps_every_part():
    parts = [triangle([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), triangle([[5, 0, 0], [6, 0, 0], [5, 1, 0]])]
    mesh = joined(parts)
    assert np.allclose(mesh.vertices_mm[mesh.faces[1]], parts[1].vertices_mm)


def test_upright_turns_y_up_to_z_up():
    mesh = triangle([[0, 0, 0], [0, 2, 0], [1, 0, 0]]).standing_upright()
    assert np.allclose(mesh.vertices_mm[1], [0.0, 0.0, 2.0])


@pytest.mark.parametrize(
    ("vertices", "said"),
    [
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], "not finite"),
        ([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], "not finite"),
        ([[1, 1, 1], [1, 1, 1], [1, 1, 1]], "no extent"),
    ],
)
def test_impossible_vertices_are_refused(vertices, said):
    with pytest.raises(MeshError, match=said):
        triangle(vertices)


def test_no_faces_is_refused():
    with pytest.raises(MeshError, match="no faces"):
        Mesh(np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((0, 3), np.int32), np.zeros((3, 3), np.float32))


@pytest.mark.parametrize("size", [0.0, -3.0, np.nan, np.inf])
def test_impossible_size_is_refused(size):
    with pytest.raises(MeshError, match="positive length"):
        default_object().placed(size)


@pytest.mark.parametrize("faces", [400, 1000, 2500, 4000, 16000])
def test_the_default_object_is_the_same_at_any_number_of_triangles(faces):
    mesh, fine = default_object(faces), default_object(40_000)
    assert 0.8 * faces < len(mesh.faces) <= max(faces, 500)
    placed, expected = mesh.placed(50.0), fine.placed(50.0)
    assert np.allclose(mesh.extent_mm, fine.extent_mm)
    # vertices lie on the smooth surface, so they stay within its box and reach nearly to its walls
    assert np.all(placed.vertices_mm.max(axis=0) <= expected.vertices_mm.max(axis=0) + 0.02)
    assert np.all(placed.vertices_mm.max(axis=0) > expected.vertices_mm.max(axis=0) - 3.0)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)
    corners = mesh.vertices_mm[mesh.faces]
    assert np.sum(np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]) > 0


def test_the_default_object_s_normals_are_the_surface_s():
    mesh = default_object(40_000)
    assert np.quantile(np.sum(mesh.normals * smooth_normals(mesh.vertices_mm, mesh.faces), axis=1), 0.01) > 0.98


@pytest.mark.parametrize("yaw_deg", [0.0, 35.0])
def test_a_mesh_with_a_box_of_its_own_is_placed_by_that(yaw_deg):
    box = from_trimesh(trimesh.creation.box(extents=(4.0, 2.0, 1.0)))
    low, high = box.vertices_mm.min(axis=0), box.vertices_mm.max(axis=0)
    boxed = replace(box, box_mm=np.stack([low, high]))
    assert np.allclose(
        boxed.placed(80.0, (5.0, -7.0), yaw_deg).vertices_mm, box.placed(80.0, (5.0, -7.0), yaw_deg).vertices_mm
    )
    halved = replace(box, box_mm=np.stack([2.0 * low, 2.0 * high])).placed(80.0)
    assert np.allclose(halved.extent_mm, [40.0, 20.0, 10.0])
    assert np.allclose(boxed.standing_upright().extent_mm, [4.0, 1.0, 2.0])
