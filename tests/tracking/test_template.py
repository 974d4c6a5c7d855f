import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from arlight.tracking.template import OFFSETS, FiducialTemplate
from arlight.tracking.template_kernels import render


def draw(template: FiducialTemplate, sigma, reach) -> tuple[np.ndarray, np.ndarray]:
    m, p = template.index_u.shape
    points, values = np.zeros((m, 2, p)), np.zeros((m, 3, p))
    render(
        template.black, template.position_base, template.position_spread, template.index_u, template.index_v,
        np.tile(sigma, (m, 1)).astype(float), np.tile(reach, (m, 1)).astype(float), points, values,
    )  # fmt: skip
    return points, values


@pytest.mark.parametrize("sigma", [(0.08, 0.08), (0.2, 0.45), (0.9, 0.3)])
def test_it_is_the_marker_blurred(sheet, sigma) -> None:
    template = FiducialTemplate.of_probe(sheet)
    points, values = draw(template, sigma, (0.2, 0.3))
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    texels, around = 32, 6
    for m, marker in enumerate(sheet.markers):
        image = dictionary.generateImageMarker(marker.id, 6 * texels, borderBits=1) / 255.0
        image = np.pad(image, around * texels, constant_values=1.0)
        blurred = gaussian_filter(image, (sigma[1] * texels, sigma[0] * texels), truncate=6)
        rows, columns = (points[m, 1] + around) * texels - 0.5, (points[m, 0] + around) * texels - 0.5
        # Bilinear look-up in the raster bends edges by up to (texel / sigma)^2 / 8.
        tolerance = (1 / texels / min(sigma)) ** 2 / 8 * 0.25 + 2e-4
        np.testing.assert_allclose(values[m, 0], map_coordinates(blurred, [rows, columns], order=1), atol=tolerance)


def test_its_derivatives(sheet) -> None:
    template = FiducialTemplate.of_probe(sheet)
    step = 1e-4
    _, values = draw(template, (0.15, 0.25), (0.1, 0.2))
    shifted = []
    for axis in (0, 1):
        for sign in (1, -1):
            moved = FiducialTemplate.of_probe(sheet)
            base = moved.position_base + sign * step
            m, p = moved.index_u.shape
            out = np.zeros((m, 3, p))
            # A point moved along one axis only: its other coordinate comes from the unmoved table, appended behind.
            both = np.concatenate([base, moved.position_base])
            spread = np.tile(moved.position_spread, 2)
            index_u = moved.index_u + (0 if axis == 0 else len(base))
            index_v = moved.index_v + (0 if axis == 1 else len(base))
            sigma, reach = np.tile([0.15, 0.25], (m, 1)), np.tile([0.1, 0.2], (m, 1))
            render(moved.black, both, spread, index_u, index_v, sigma, reach, np.zeros((m, 2, p)), out)
            shifted.append(out[:, 0])
    np.testing.assert_allclose((shifted[0] - shifted[1]) / (2 * step), values[:, 1], atol=1e-4)
    np.testing.assert_allclose((shifted[2] - shifted[3]) / (2 * step), values[:, 2], atol=1e-4)


@pytest.mark.parametrize("part", [1, 2])
def test_points_lie_evenly_on_both_sides_of_edges(sheet, part) -> None:
    template = FiducialTemplate.of_probe(sheet)
    number = template.index_u.shape[1] // part
    points, values = draw(template, (0.1, 0.1), (0.1, 0.1))
    for m in range(len(sheet.markers)):
        u, v = points[m, :, :number]
        across = np.where(template.position_spread[template.index_u[m, :number]] != 0, u, v)
        offsets = across - np.round(across)
        np.testing.assert_allclose(
            np.sort(offsets.reshape(-1, len(OFFSETS)), axis=1),
            np.tile(np.array(OFFSETS) * 0.1, (number // 4, 1)),
            atol=1e-12,
        )
        # Half of them on black: every edge has one black side.
        assert abs(np.mean(values[m, 0, :number]) - 0.5) < 0.05


def test_points_stay_in_the_quiet_zone(sheet) -> None:
    points, _ = draw(FiducialTemplate.of_probe(sheet), (2.0, 2.0), (3.0, 3.0))
    assert points.min() >= -1.0
    assert points.max() <= 7.0


def test_modules_lie_where_the_sheet_says(sheet) -> None:
    template = FiducialTemplate.of_probe(sheet)
    origin, step_u, step_v = template.places[:, :2], template.places[:, 2:4], template.places[:, 4:]
    corners = np.array([marker.corners_mm for marker in sheet.markers])
    np.testing.assert_allclose(origin + 6 * step_u + 6 * step_v, corners[:, 2], atol=1e-12)
    np.testing.assert_allclose(origin + 6 * step_v, corners[:, 3], atol=1e-12)
