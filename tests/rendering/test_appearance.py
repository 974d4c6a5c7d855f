from dataclasses import replace

import numpy as np
import pytest
import trimesh

from arlight.fourier import frequency_order, pack_real
from arlight.rendering.appearance import appearance
from arlight.rendering.default_object import default_object
from arlight.rendering.gloss import gloss_rows
from arlight.rendering.mesh_file import from_trimesh
from arlight.rendering.transfer import precompute_transfer
from arlight.synthetic.captured import captured_names, load_environment


def made(mesh, reconstruction, probe, roughness=0.3, reflectance=0.0):
    transfer = precompute_transfer(mesh, reconstruction, 128, 32)
    rows = gloss_rows(reconstruction, roughness)
    return appearance(mesh, transfer, rows, roughness, reflectance, probe.frequencies)


@pytest.fixture(scope="module")
def ball(reconstruction, probe):
    mesh = from_trimesh(trimesh.creation.icosphere(subdivisions=3)).placed(40.0)
    return made(replace(mesh, base_colour=np.ones_like(mesh.base_colour)), reconstruction, probe)


@pytest.fixture(scope="module")
def mirror(reconstruction, probe):
    return made(default_object(2000).placed(40.0), reconstruction, probe, 0.1, 0.9)


def test_shares_are_positive_and_whole(ball, mirror):
    for seen in (ball, mirror):
        shares = seen.energy_by_order()
        assert shares.shape == (6,)
        assert shares.min() > 0.0
        assert shares.sum() == pytest.approx(1.0)


def test_a_matte_ball_needs_less_than_a_shiny_knot(ball, mirror):
    beyond = [1.0 - np.cumsum(seen.energy_by_order())[:5] for seen in (ball, mirror)]
    assert np.all(beyond[0] < 0.6 * beyond[1])


def test_uniform_light_makes_the_radiance_of_a_white_surface(ball, probe):
    """Unit light all round: about unit radiance, less what a ball hides from itself below, on top of the shadow's."""
    from arlight.environment import Environment

    packed = pack_real(Environment(np.ones((32, 64, 3), np.float32)).coefficients(probe.slab, probe.frequencies))[:, 1]
    assert 0.8 < np.sqrt(packed @ ball.gram @ packed) < 1.3


def test_it_foretells_what_captured_light_loses(ball, mirror, reconstruction, probe):
    """Root mean square over environments of what is lost with the light up to an order, what it predicts put in."""
    packed_order = np.repeat(frequency_order(probe.frequencies), 2)[1:]
    lights = []
    for name in captured_names():
        for yaw in (0.0, 2.0, 4.0):
            environment = load_environment(name).rotated(yaw)
            lights.append(pack_real(environment.coefficients(probe.slab, probe.frequencies).mean(axis=1)))
    for seen in (ball, mirror):
        left = np.sqrt(np.maximum(1.0 - np.cumsum(seen.energy_by_order()), 0.0))
        for order in range(1, 5):
            kept = packed_order <= order
            lost = [light - reconstruction.completed(light[kept, None])[:, 0] for light in lights]
            shares = [x @ seen.gram @ x / (light @ seen.gram @ light) for x, light in zip(lost, lights, strict=True)]
            assert 0.5 < left[order] / np.sqrt(np.mean(shares)) < 2.0


def test_errors_grow_with_the_light_s(mirror, environment, probe):
    packed = pack_real(environment.coefficients(probe.slab, probe.frequencies))[:, 1]
    covariance = 1e-4 * np.eye(len(packed))
    once = mirror.relative_error(covariance, packed)
    assert once > 0.0
    assert mirror.relative_error(4.0 * covariance, packed) == pytest.approx(2.0 * once)
    assert mirror.relative_error(covariance[:29, :29], packed[:29]) < once * 1.5
    # of light known to one part in a hundred, the picture is
    one = np.outer(packed, packed) * 1e-4
    assert mirror.relative_error(one, packed) == pytest.approx(0.01, rel=1e-6)
