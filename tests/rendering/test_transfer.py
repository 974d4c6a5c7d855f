from dataclasses import replace

import numpy as np
import pytest
import trimesh

from arlight.environment import Environment
from arlight.estimation.radiance_prior import hemisphere_points
from arlight.fourier import pack_real
from arlight.rendering.mesh import joined
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.reconstruction import reconstruct
from arlight.rendering.transfer import harmonics, precompute_transfer

pytestmark = pytest.mark.usefixtures("gl")


def ball(subdivisions=3):
    return from_trimesh(trimesh.creation.icosphere(subdivisions=subdivisions))


@pytest.fixture(scope="module")
def ball_transfer(reconstruction):
    mesh = ball().placed(30.0)
    return mesh, precompute_transfer(mesh, reconstruction, 256, 32)


def packed_of(environment, probe):
    return pack_real(environment.coefficients(probe.slab, probe.frequencies))


def test_furnace(probe):
    """Uniform light all round, a white convex object: it vanishes, but for the ground that it hides from itself."""
    mesh = ball().placed(30.0)
    transfer = precompute_transfer(mesh, reconstruct(probe.slab, probe.frequencies, 1.0), 256, 32)
    radiance = transfer.vertex_rows @ packed_of(Environment(np.ones((64, 128, 3), np.float32)), probe)
    upper = mesh.normals[:, 2] > 0.0
    assert np.abs(radiance[upper] - 1.0).max() < 0.05
    assert radiance[mesh.normals[:, 2] < -0.95].max() < 0.5
    assert radiance.max() < 1.03


def test_nothing_is_taken_from_a_convex_object_from_above(ball_transfer, reconstruction, probe, environment):
    mesh, transfer = ball_transfer
    packed = packed_of(environment, probe)
    expected = reconstruction.irradiance_rows(mesh.normals) @ packed / np.pi
    upper = mesh.normals[:, 2] > 0.8
    assert np.allclose((transfer.vertex_rows @ packed)[upper], expected[upper], rtol=0.01)


def test_light_from_below_is_the_ground_rule_times_what_the_object_leaves(probe):
    """Black surroundings and white ones differ by the bounce alone, and the ground in contact is dark."""
    mesh = ball().placed(30.0)
    packed = packed_of(Environment(np.ones((64, 128, 3), np.float32)), probe)
    black, white = (
        precompute_transfer(mesh, reconstruct(probe.slab, probe.frequencies, a), 128, 32).vertex_rows @ packed
        for a in (0.0, 1.0)
    )
    bounce = (white - black)[:, 1]
    rule = (1.0 - mesh.normals[:, 2]) / 2.0
    assert np.all(bounce <= 1.02 * rule + 1e-3)
    sideways = np.abs(mesh.normals[:, 2]) < 0.1
    assert np.all(bounce[sideways] > 0.5 * rule[sideways])
    assert bounce[np.argmin(mesh.normals[:, 2])] < 0.2


def test_a_ball_under_a_plate_is_darker_than_in_the_open(ball_transfer, reconstruction, probe, environment):
    mesh, transfer = ball_transfer
    plate = from_trimesh(trimesh.creation.box(extents=(60.0, 60.0, 2.0)))
    plate = replace(plate, vertices_mm=plate.vertices_mm + [0.0, 0.0, 40.0])
    both = joined([mesh, plate])
    covered = precompute_transfer(both, reconstruction, 256, 32).vertex_rows[: len(mesh.vertices_mm)]
    packed = packed_of(environment, probe)
    top = mesh.normals[:, 2] > 0.7
    beneath, free = (covered @ packed)[top], (transfer.vertex_rows @ packed)[top]
    # light from near the horizon still comes in under the plate
    assert beneath.mean() < 0.5 * free.mean()
    assert np.all(beneath <= 1.02 * free.max())


def test_turning_object_and_light_together_changes_nothing(reconstruction, probe, environment):
    part = trimesh.creation.annulus(4.0, 10.0, 6.0, sections=24)
    part.apply_translation([3.0, 0.0, 0.0])
    mesh = joined([from_trimesh(part), from_trimesh(trimesh.creation.box(extents=(4.0, 8.0, 12.0)))])
    results = []
    for yaw in (0.0, 90.0):
        placed = mesh.placed(40.0, yaw_deg=yaw)
        transfer = precompute_transfer(placed, reconstruction, 512, 32)
        results.append(transfer.vertex_rows @ packed_of(environment.rotated(np.radians(yaw)), probe))
    # the shadow directions and maps are not the same after a quarter turn: their sampling is what is left
    difference = results[1] - results[0]
    assert np.sqrt(np.mean(difference**2)) < 0.015 * results[0].mean()


def test_harmonics_are_orthonormal():
    upper = hemisphere_points(4000)
    w = np.concatenate([upper, upper * [1, 1, -1]])
    gram = 4 * np.pi / len(w) * harmonics(w).T @ harmonics(w)
    assert np.allclose(gram, np.eye(9), atol=0.01)


def test_openness_of_a_convex_object_is_free_upward_and_closed_inward(ball_transfer):
    mesh, transfer = ball_transfer
    top = mesh.normals[:, 2] > 0.9
    mirrored = hemisphere_points(50)[:20]
    seen = transfer.openness[top] @ harmonics(mirrored).T
    assert np.abs(seen - 1.0).max() < 0.05
