"""The compiled projection, told from pictures whose light is the pixel's own x or y."""

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.tracking.alignment_kernels import LIGHT, AlignmentKernels, Picture

TERMS = [-0.28, 0.12, 1.5e-3, -2.5e-3, 0.04, 0.02, -0.03, 0.01, 2e-3, -1e-3, 3e-3, 5e-4, 0.04, -0.03]
SIZE = (640, 480)


@pytest.mark.parametrize("terms", [0, 4, 5, 8, 12, 14])
def test_it_is_opencv_s_projection(sheet, look, terms: int) -> None:
    camera = Camera(SIZE, np.array([[600.0, 0, 310], [0, 640, 250], [0, 0, 1]]), np.array(TERMS[:terms]))
    # half of the sheet is out of the picture
    pose = look(35, 120, 300, 20, (60, -30))
    kernels = AlignmentKernels(sheet, camera)
    kernels.draw(pose, 1.0)
    along = np.concatenate([kernels.places[:, None, 2:4], kernels.places[:, None, 4:6]], axis=1)
    on_sheet = kernels.places[:, :2, None] + np.einsum("mkx,mkp->mxp", along, kernels.at.astype(float))
    points = np.moveaxis(on_sheet, 1, 2).reshape(-1, 2)
    expected = camera.project(pose, np.column_stack([points, np.zeros(len(points))])).T
    inside = np.all(np.abs(expected.T / (np.array(SIZE) - 1) - 0.5) < 0.5, axis=1)
    assert 0.2 < np.mean(inside) < 0.9
    for axis, ramp in enumerate(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))):
        kernels.show(Picture(ramp.astype(np.uint16), np.arange(1024, dtype=np.float32)))
        kernels.observe(pose, -1.0)
        light = kernels.features[:, LIGHT].ravel()
        np.testing.assert_allclose(light[inside], expected[axis][inside], atol=3e-4)
        np.testing.assert_array_equal(light[~inside], -1.0)


def test_a_pose_that_is_not_a_number_is_out_of_the_picture(sheet, camera) -> None:
    kernels = AlignmentKernels(sheet, camera)
    kernels.show(Picture(np.full((480, 640), 9, np.uint8), np.ones(256, np.float32)))
    for broken in (np.nan, np.inf):
        pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, broken, 300.0]))
        kernels.draw(pose, 1.0)
        assert kernels.observe(pose, -1.0) == 0
        np.testing.assert_array_equal(kernels.features[:, LIGHT], -1.0)
