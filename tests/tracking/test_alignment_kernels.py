"""The compiled normal equations against plain numpy."""

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.color import linear_from_encoded
from arlight.tracking.alignment_kernels import FEATURES, LIGHT, LIGHTING, AlignmentKernels, Picture

TABLE = linear_from_encoded(np.arange(256) / 255.0)
OUTLIER_LIMIT, SMALLEST_VARIANCE = 0.25, 4e-4


@pytest.fixture(scope="module")
def observed(sheet, bent_camera, look, photograph):
    """The kernels after two observations close to the truth, most of a marker covered, and the lighting between."""
    truth = look(35, 60, 330, 20)
    x, y = bent_camera.project(truth, [[*np.mean(sheet.markers[4].corners_mm, axis=0), 0.0]])[0].astype(int)

    def covered(linear):
        linear[y - 40 : y + 40, x - 10 : x + 40] = 0.5
        return linear

    kernels = AlignmentKernels(sheet, bent_camera)
    kernels.show(Picture(photograph(bent_camera, truth, cover=covered), TABLE))
    pose = Pose(truth.rotation, truth.translation + [0.2, -0.1, 0.3])
    kernels.draw(pose, 0.8)
    kernels.observe(pose, -1.0)
    before = kernels.coefficients.copy()
    used = kernels.observe(pose, 0.6)
    return kernels, pose, before, used


def _weights(features, lighting):
    residual = features[LIGHT] - lighting @ features[:LIGHTING]
    return 1.0 / (1.0 + (residual / (OUTLIER_LIMIT * lighting[0])) ** 2)


def test_weighted_products_without_the_lighting(observed) -> None:
    kernels, _, before, _ = observed
    for m, f in enumerate(kernels.features.astype(float)):
        root = np.sqrt(_weights(f, before[m]))
        light, rest = (f[:LIGHTING] * root).T, (f[LIGHTING:] * root).T
        solution = np.linalg.lstsq(light, rest, rcond=None)[0]
        left = rest - light @ solution
        np.testing.assert_allclose(kernels.coefficients[m], solution[:, -1], rtol=2e-4, atol=2e-5)
        expected = left.T @ left
        scale = np.sqrt(np.outer(np.sum(rest**2, axis=0), np.sum(rest**2, axis=0)))
        found = np.triu(kernels.gram[m, LIGHTING:, LIGHTING:])
        np.testing.assert_allclose(found / scale, np.triu(expected) / scale, atol=1e-5)


def test_correlation_and_weight_of_each_marker(observed) -> None:
    kernels, _, before, used = observed
    weights = []
    for m, f in enumerate(kernels.features.astype(float)):
        assert kernels.correlation[m] == pytest.approx(np.corrcoef(f[0], f[LIGHT])[0, 1], abs=1e-4)
        lighting = kernels.coefficients[m]
        squared = np.sum(_weights(f, before[m]) * (f[LIGHT] - lighting @ f[:LIGHTING]) ** 2)
        weights.append(1.0 / (squared / (lighting[0] ** 2 * f.shape[1]) + SMALLEST_VARIANCE))
    seen = kernels.correlation > 0.6
    assert not seen[4]
    assert used == np.count_nonzero(seen) == 7
    np.testing.assert_allclose(kernels.weight, np.where(seen, weights, 0.0), rtol=1e-3)


def test_derivatives_by_the_pose(observed) -> None:
    kernels, pose, _, _ = observed
    step = 1e-5
    for m, place in enumerate(kernels.places):
        origin, along = place[:2], place[2:].reshape(2, 2).T
        points = (origin[:, None] + along @ kernels.at[m].astype(float)).T
        middle = pose.transform([*(origin + along @ [3.0, 3.0]), 0.0])
        seen = pose.transform(np.column_stack([points, np.zeros(len(points))]))
        rays = seen / seen[:, 2:]
        for k in range(6):
            moved = []
            for sign in (step, -step):
                by = sign * np.eye(6)[k]
                turn = Pose.from_rvec(by[:3], np.zeros(3)).rotation
                other = Pose(turn @ pose.rotation, turn @ (pose.translation - middle) + middle + by[3:])
                # where the same rays now meet the sheet
                toward = rays @ other.rotation
                centre = other.camera_centre_mm
                on_sheet = (centre - toward * (centre[2] / toward[:, 2:]))[:, :2]
                moved.append(np.linalg.solve(along, (on_sheet - origin).T))
            by_place = (moved[1] - moved[0]) / (2 * step)
            expected = np.sum(kernels.slope[m] * by_place, axis=0)
            found = kernels.features[m, LIGHTING + k]
            np.testing.assert_allclose(found, expected, atol=1e-4 * np.max(np.abs(expected)) + 1e-5)


@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (3, 200), (7, 7), (31, 17)])
@pytest.mark.parametrize("coarsest", [1, 2, 4, 8])
def test_pictures_of_few_pixels(sheet, shape, coarsest) -> None:
    camera = Camera(shape[::-1], np.array([[50.0, 0, 8], [0, 50, 8], [0, 0, 1]]), np.zeros(5))
    kernels = AlignmentKernels(sheet, camera)
    kernels.show(Picture(np.random.default_rng(0).integers(0, 255, shape, dtype=np.uint8), TABLE))
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))
    assert not kernels.align(pose, 0.8, coarsest)
    assert np.all(np.isfinite(kernels.correlation))


@pytest.mark.parametrize(
    ("luma", "table"),
    [
        (np.zeros((480, 641), np.uint8), TABLE),
        (np.zeros((480, 640), np.int16), TABLE),
        (np.zeros((480, 640, 3), np.uint8), TABLE),
        (np.zeros((480, 640), np.uint8), TABLE[:255]),
        (np.zeros((480, 640), np.uint16), TABLE),
        (np.zeros((480, 640), np.uint8), TABLE.astype(float)),
        (np.zeros((480, 640), np.uint8), np.zeros(512, np.float32)[::2]),
    ],
)
def test_what_the_compiled_code_cannot_read_is_refused(sheet, camera, luma, table) -> None:
    with pytest.raises(ValueError, match="must be"):
        AlignmentKernels(sheet, camera).show(Picture(luma, table))


def test_codes_beyond_the_table_are_its_last(sheet, camera, look) -> None:
    kernels, pose = AlignmentKernels(sheet, camera), look(20, 0, 420)
    kernels.show(Picture(np.full((480, 640), 60000, np.uint16), np.linspace(0, 1, 1024, dtype=np.float32)))
    kernels.draw(pose, 0.8)
    kernels.observe(pose, -1.0)
    np.testing.assert_array_equal(kernels.features[:, LIGHT], 1.0)
    assert kernels.features.shape[1] == FEATURES
