from types import SimpleNamespace

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.errors import RenderingUnavailableError
from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies
from arlight.gl import create_context
from arlight.optics import Slab
from arlight.rendering.reconstruction import reconstruct
from arlight.synthetic.captured import load_environment


@pytest.fixture(scope="session")
def gl():
    """Skips where there is no headless OpenGL; nothing else does."""
    try:
        create_context().release()
    except RenderingUnavailableError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def probe():
    return SimpleNamespace(slab=Slab(), frequencies=half_plane_frequencies(5))


@pytest.fixture(scope="session")
def reconstruction(probe):
    return reconstruct(probe.slab, probe.frequencies)


@pytest.fixture(scope="session")
def environment():
    return load_environment("apartment").scaled(0.3)


@pytest.fixture(scope="session")
def lighting_of(probe):
    def make(environment):
        k = len(probe.frequencies)
        coefficients = environment.coefficients(probe.slab, probe.frequencies)
        return Lighting(probe.frequencies, coefficients, np.zeros((3, 2 * k - 1, 2 * k - 1)), 0.0, 1.0)

    return make


@pytest.fixture(scope="session")
def camera():
    return Camera((320, 240), np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]]), np.zeros(5))


@pytest.fixture(scope="session")
def lens_camera(camera):
    return Camera(camera.image_size, camera.camera_matrix, np.array([-0.25, 0.08, 0.002, -0.003, 0.0]))


@pytest.fixture(scope="session")
def looking_down():
    """Makes poses that look at the origin from the front, some angle off the normal, from some distance."""

    def make(off_normal_deg, distance_mm):
        a = np.radians(off_normal_deg)
        rotation = np.array([[1.0, 0.0, 0.0], [0.0, -np.cos(a), -np.sin(a)], [0.0, np.sin(a), -np.cos(a)]])
        return Pose(rotation, np.array([0.0, 0.0, distance_mm]))

    return make


@pytest.fixture(scope="session")
def pose(looking_down):
    return looking_down(40.0, 300.0)
