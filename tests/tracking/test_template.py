import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.special import ndtr

from arlight.camera import Camera, Pose
from arlight.tracking.alignment_kernels import AlignmentKernels
from arlight.tracking.template import OFFSETS, FiducialTemplate

MODULE_MM = 2.7
BLUR_PX, BLUR_ROW = 1.5, 10


def draw(sheet, sigma) -> AlignmentKernels:
    """The templates blurred by so many modules along u and v: a camera with oblong pixels looks straight down."""
    focal = BLUR_PX / (np.array(sigma) * MODULE_MM) * 1000.0
    camera = Camera((64, 64), np.array([[focal[0], 0, 32], [0, focal[1], 32], [0, 0, 1]]), np.zeros(5))
    kernels = AlignmentKernels(sheet, camera)
    kernels.draw(Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 1000.0])), BLUR_PX)
    return kernels


def white(black: np.ndarray, u: np.ndarray, v: np.ndarray, sigma) -> np.ndarray:
    """The template of black squares (rows, columns) at points, plainly."""
    steps = np.arange(len(black) + 1)
    share_u = -np.diff(ndtr((u[:, None] - steps) / sigma[0]), axis=1)
    share_v = -np.diff(ndtr((v[:, None] - steps) / sigma[1]), axis=1)
    return 1.0 - np.einsum("pr,rc,pc->p", share_v, black, share_u)


@pytest.mark.parametrize("sigma", [(0.08, 0.08), (0.2, 0.45), (0.9, 0.3)])
def test_it_is_the_marker_blurred(sheet, sigma) -> None:
    kernels = draw(sheet, sigma)
    points = kernels.at
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    texels, around = 32, 6
    for m, marker in enumerate(sheet.markers):
        image = dictionary.generateImageMarker(marker.id, 6 * texels, borderBits=1) / 255.0
        image = np.pad(image, around * texels, constant_values=1.0)
        blurred = gaussian_filter(image, (sigma[1] * texels, sigma[0] * texels), truncate=6)
        rows, columns = (points[m, 1] + around) * texels - 0.5, (points[m, 0] + around) * texels - 0.5
        # Bilinear look-up in the raster bends edges by up to (texel / sigma)^2 / 8.
        tolerance = (1 / texels / min(sigma)) ** 2 / 8 * 0.25 + 2e-4
        expected = map_coordinates(blurred, [rows, columns], order=1)
        np.testing.assert_allclose(kernels.features[m, 0], expected, atol=tolerance)


@pytest.mark.parametrize("sigma", [(0.12, 0.12), (0.15, 0.25), (0.7, 0.4)])
def test_its_derivatives_by_place_and_blur(sheet, sigma) -> None:
    kernels, black = draw(sheet, sigma), FiducialTemplate.of_probe(sheet).black
    step = 1e-4
    for m in range(len(black)):
        u, v = kernels.at[m].astype(float)
        np.testing.assert_allclose(kernels.features[m, 0], white(black[m], u, v, sigma), atol=3e-6)
        along_u, along_v = (
            (white(black[m], u + du, v + dv, sigma) - white(black[m], u - du, v - dv, sigma)) / (2 * step)
            for du, dv in ((step, 0.0), (0.0, step))
        )
        np.testing.assert_allclose(kernels.slope[m], [along_u, along_v], atol=1e-4)
        wider, narrower = (np.array(sigma) * np.sqrt(1.0 + sign * step) for sign in (1, -1))
        of_variance = white(black[m], u, v, wider) - white(black[m], u, v, narrower)
        np.testing.assert_allclose(
            kernels.features[m, BLUR_ROW], of_variance / (2 * step * BLUR_PX**2), atol=1e-4 / BLUR_PX**2
        )


def test_slopes_of_the_lighting_run_from_edge_to_edge(sheet) -> None:
    kernels = draw(sheet, (0.2, 0.3))
    t, across, down, bias = np.moveaxis(kernels.features[:, :4], 1, 0)
    np.testing.assert_allclose(across, t * (kernels.at[:, 0] / 3.0 - 1.0), atol=1e-6)
    np.testing.assert_allclose(down, t * (kernels.at[:, 1] / 3.0 - 1.0), atol=1e-6)
    np.testing.assert_array_equal(bias, 1.0)


def test_it_is_drawn_anew_when_the_blur_has_changed(sheet, camera) -> None:
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))
    kernels = AlignmentKernels(sheet, camera)
    kernels.draw(pose, 1.0)
    first = kernels.features[:, 0].copy()
    kernels.draw(pose, 1.005)
    np.testing.assert_array_equal(kernels.features[:, 0], first)
    kernels.draw(pose, 1.1)
    wider = kernels.features[:, 0].copy()
    assert not np.array_equal(wider, first)
    kernels.draw(Pose(pose.rotation, pose.translation * 1.1), 1.0)
    # as blurred in modules, to single precision
    np.testing.assert_allclose(kernels.features[:, 0], wider, atol=1e-5)


@pytest.mark.parametrize("part", [1, 2])
def test_points_lie_evenly_on_both_sides_of_edges(sheet, part) -> None:
    template = FiducialTemplate.of_probe(sheet)
    number = template.index_u.shape[1] // part
    kernels = draw(sheet, (0.1, 0.1))
    for m in range(len(sheet.markers)):
        u, v = kernels.at[m, :, :number]
        across = np.where(template.position_spread[template.index_u[m, :number]] != 0, u, v)
        offsets = across - np.round(across)
        np.testing.assert_allclose(
            np.sort(offsets.reshape(-1, len(OFFSETS)), axis=1),
            np.tile(np.array(OFFSETS) * 0.1, (number // 4, 1)),
            atol=2e-6,
        )
        # Half of them on black: every edge has one black side.
        assert abs(np.mean(kernels.features[m, 0, :number]) - 0.5) < 0.05


def test_points_stay_in_the_quiet_zone(sheet) -> None:
    points = draw(sheet, (2.0, 2.0)).at
    assert points.min() >= -1.0
    assert points.max() <= 7.0


def test_modules_lie_where_the_sheet_says(sheet) -> None:
    template = FiducialTemplate.of_probe(sheet)
    origin, step_u, step_v = template.places[:, :2], template.places[:, 2:4], template.places[:, 4:]
    corners = np.array([marker.corners_mm for marker in sheet.markers])
    np.testing.assert_allclose(origin + 6 * step_u + 6 * step_v, corners[:, 2], atol=1e-12)
    np.testing.assert_allclose(origin + 6 * step_v, corners[:, 3], atol=1e-12)
