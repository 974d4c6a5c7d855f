import numpy as np
import pytest

from arlight.environment import Environment
from arlight.estimation.radiance_prior import hemisphere_points
from arlight.fourier import pack_real
from arlight.rendering.directional import directional_lights
from arlight.synthetic.captured import load_environment


def lamp_environment(direction, radius_deg=6.0, ambient=0.05):
    rows = 128
    theta = (np.arange(rows) + 0.5)[:, None] * np.pi / rows
    phi = (np.arange(2 * rows) + 0.5)[None] * np.pi / rows
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1)
    lit = w @ direction > np.cos(np.radians(radius_deg))
    return Environment((ambient + 30.0 * lit[..., None] * [1.0, 0.8, 0.5]).astype(np.float32))


@pytest.mark.parametrize("elevation_deg", [40.0, 60.0, 85.0])
def test_one_lamp_is_found_where_it_stands(reconstruction, probe, elevation_deg):
    e = np.radians(elevation_deg)
    lamp = np.array([np.cos(e) * 0.6, np.cos(e) * 0.8, np.sin(e)])
    packed = pack_real(lamp_environment(lamp).coefficients(probe.slab, probe.frequencies))
    lights = directional_lights(reconstruction, packed)
    strongest = lights.directions[np.argmax(lights.irradiance.sum(axis=1))]
    assert np.degrees(np.arccos(strongest @ lamp)) < 8.0
    mean = lights.irradiance.sum(axis=0) @ np.eye(3)
    assert mean[0] > mean[1] > mean[2]


def test_the_lights_give_normals_nearly_what_the_reconstruction_gives(reconstruction, probe):
    normals = hemisphere_points(200)
    for name in ("apartment", "hall"):
        packed = pack_real(load_environment(name).coefficients(probe.slab, probe.frequencies))
        lights = directional_lights(reconstruction, packed)
        assert len(lights.directions) <= 4
        assert np.allclose(np.linalg.norm(lights.directions, axis=1), 1.0)
        total = np.maximum(normals @ lights.directions.T, 0) @ lights.irradiance + np.pi * lights.ambient_radiance
        wanted = reconstruction.irradiance_rows(normals) @ packed
        assert np.sqrt(np.mean((total - wanted) ** 2)) < 0.15 * wanted.mean()


def test_darkness_has_no_lights(reconstruction, probe):
    lights = directional_lights(reconstruction, np.zeros((2 * len(probe.frequencies) - 1, 3)))
    assert np.all(lights.irradiance == 0.0)
    assert np.all(lights.ambient_radiance == 0.0)


def test_uniform_light_is_ambient(reconstruction, probe):
    uniform = Environment(np.ones((64, 128, 3), np.float32))
    lights = directional_lights(reconstruction, pack_real(uniform.coefficients(probe.slab, probe.frequencies)))
    up = np.array([0.0, 0.0, 1.0])
    total = np.maximum(lights.directions @ up, 0) @ lights.irradiance + np.pi * lights.ambient_radiance
    assert np.allclose(total, np.pi, rtol=0.1)
    assert np.all(lights.ambient_radiance > 0.3)
