import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.tracking.lens import camera_parameters, project

TERMS = [-0.28, 0.12, 1.5e-3, -2.5e-3, 0.04, 0.02, -0.03, 0.01, 2e-3, -1e-3, 3e-3, 5e-4, 0.04, -0.03]


@pytest.mark.parametrize("terms", [0, 4, 5, 8, 12, 14])
def test_it_is_opencv_s_projection(terms: int) -> None:
    camera = Camera((640, 480), np.array([[600.0, 0, 310], [0, 640, 250], [0, 0, 1]]), np.array(TERMS[:terms]))
    rays = np.random.default_rng(terms).uniform(-0.5, 0.5, (50, 2))
    expected = camera.project(Pose(np.eye(3), np.zeros(3)), np.column_stack([rays, np.ones(50)]))
    parameters = camera_parameters(camera)
    np.testing.assert_allclose([project(parameters, x, y) for x, y in rays], expected, atol=1e-9)
