import numpy as np
import pytest

from arlight.environment import Environment
from arlight.estimation.radiance_prior import hemisphere_points, received_operator
from arlight.fourier import half_plane_frequencies, pack_real
from arlight.optics import Slab
from arlight.rendering.reconstruction import reconstruct
from arlight.synthetic.captured import captured_names, load_environment

UNIFORM = Environment(np.ones((64, 128, 3), np.float32))


def packed_of(environment, slab, frequencies):
    return pack_real(environment.coefficients(slab, frequencies))


def test_hemisphere_points_are_unit_and_average_as_the_hemisphere_does():
    w = hemisphere_points(1000)
    assert np.allclose(np.linalg.norm(w, axis=1), 1.0)
    # integrals of 1, z, z^2, x^2 over the hemisphere, divided by 2 pi
    assert np.allclose([w[:, 2].mean(), (w[:, 2] ** 2).mean(), (w[:, 0] ** 2).mean()], [1 / 2, 1 / 3, 1 / 3], atol=2e-3)


@pytest.mark.parametrize("order", [1, 3, 8])
def test_reconstructed_light_has_the_coefficients_it_was_made_from(order):
    slab, frequencies = Slab(), half_plane_frequencies(order)
    r = reconstruct(slab, frequencies)
    # an independent set of directions: R must reproduce its coefficients as light, not as samples
    w = hemisphere_points(3001)
    operator = received_operator(slab, frequencies, w, np.full(len(w), 2 * np.pi / len(w)))
    packed = packed_of(load_environment("apartment"), slab, frequencies)
    again = operator @ r.radiance_rows(w) @ packed
    assert np.abs(again - packed).max() < 0.02 * packed[0].max()


@pytest.mark.parametrize(("order", "most"), [(2, 0.08), (5, 0.04)])
def test_uniform_light_comes_back_uniform(order, most):
    slab, frequencies = Slab(), half_plane_frequencies(order)
    r = reconstruct(slab, frequencies)
    radiance = r.rows @ packed_of(UNIFORM, slab, frequencies)
    seen = r.directions[:, 2] > np.cos(np.radians(75))
    assert np.abs(radiance[seen] - 1.0).max() < most
    assert r.upward_irradiance_row @ packed_of(UNIFORM, slab, frequencies) == pytest.approx(np.pi, rel=0.01)


def test_scale_of_the_light_passes_through(reconstruction, environment, probe):
    one = packed_of(environment, probe.slab, probe.frequencies)
    many = packed_of(environment.scaled(1000.0), probe.slab, probe.frequencies)
    assert np.allclose(reconstruction.rows @ many, 1000.0 * (reconstruction.rows @ one), rtol=1e-4)


def test_turning_the_light_turns_what_is_reconstructed(reconstruction, environment, probe):
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    still = reconstruction.radiance_rows(hemisphere_points(500)) @ packed_of(environment, probe.slab, probe.frequencies)
    turned = reconstruction.radiance_rows(hemisphere_points(500) @ quarter.T) @ packed_of(
        environment.rotated(np.pi / 2), probe.slab, probe.frequencies
    )
    # exact but for the quadrature points, which a quarter turn does not map onto themselves
    assert np.abs(turned - still).max() < 0.02 * np.abs(still).max()


def test_irradiance_rows_are_the_integral_of_the_radiance_rows(reconstruction, environment, probe):
    packed = packed_of(environment, probe.slab, probe.frequencies)
    normals = hemisphere_points(23) * [1, 1, -1] + [0.0, 0.3, 0.6]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rng = np.random.default_rng(5)
    w = rng.standard_normal((6000, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    radiance = reconstruction.radiance_rows(w) @ packed
    monte_carlo = 4 * np.pi / len(w) * np.maximum(normals @ w.T, 0.0) @ radiance
    expected = reconstruction.irradiance_rows(normals) @ packed
    assert np.abs(monte_carlo - expected).max() < 0.06 * expected.max()  # 6000 samples: 1.5 % deviation each


def test_ground_is_the_stated_rule(probe, environment):
    packed = packed_of(environment, probe.slab, probe.frequencies)
    for albedo in (0.0, 0.3, 1.0):
        r = reconstruct(probe.slab, probe.frequencies, albedo)
        up = r.upward_irradiance_row @ packed
        below = r.radiance_rows(np.array([[0.0, 0.6, -0.8], [0.0, 0.0, -1.0]])) @ packed
        assert np.allclose(below, albedo * up / np.pi)
        assert np.allclose(r.irradiance_rows(np.array([[0.0, 0.0, -1.0]])) @ packed, albedo * up, rtol=1e-6)


def test_an_impossible_albedo_is_refused(probe):
    with pytest.raises(ValueError, match="surroundings_albedo"):
        reconstruct(probe.slab, probe.frequencies, 1.2)


@pytest.mark.parametrize(("order", "most"), [(1, 0.22), (3, 0.15), (5, 0.10)])
def test_irradiance_error_over_captured_environments(order, most):
    """Median relative error over normals of the upper hemisphere; more coefficients, less error."""
    slab, frequencies = Slab(), half_plane_frequencies(order)
    r = reconstruct(slab, frequencies, surroundings_albedo=0.0)
    normals = hemisphere_points(40)
    errors = []
    for name in captured_names():
        for yaw in (0.0, 2.0, 4.0):
            environment = load_environment(name).rotated(yaw)
            directions, light = environment.samples()
            truth = np.maximum(normals @ directions.T, 0.0) @ light
            estimate = r.irradiance_rows(normals) @ packed_of(environment, slab, frequencies)
            errors.append(np.abs(estimate - truth) / truth)
    assert np.median(errors) < most
