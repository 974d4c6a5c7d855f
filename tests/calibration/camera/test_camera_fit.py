"""Bundle adjustment against points projected by hand: unbiased, and as uncertain as it says."""

import numpy as np
import pytest

from arlight.calibration.camera.camera_fit import NAMES, Expectation, TargetView, fit_camera

SIZE = (640, 480)
GRID = np.array([[x, y] for x in np.linspace(-60, 60, 6) for y in np.linspace(-45, 45, 5)])


@pytest.fixture(scope="module")
def views_of(lens_camera, look, project):
    def views(number, noise_px, seed, tilts=(20.0, 50.0), alike=False):
        rng = np.random.default_rng(seed)
        found = []
        for k in range(number):
            place = np.random.default_rng(seed) if alike else rng
            pose = look(
                place.uniform(*tilts), place.uniform(0, 360), place.uniform(180, 280), place.uniform(-90, 90),
                place.uniform(-15, 15, 2),
            )  # fmt: skip
            pixels = project(lens_camera, pose, GRID) + noise_px * rng.normal(size=GRID.shape)
            found.append(TargetView(f"view {k}", GRID, pixels))
        return found

    return views


def truth_of(camera):
    k = camera.camera_matrix
    return np.array([np.log(k[1, 1]), np.log(k[0, 0] / k[1, 1]), k[0, 2], k[1, 2], *camera.distortion])


def parameters(fit):
    return truth_of(fit.camera)


def test_exact_points_give_the_camera_back(views_of, lens_camera):
    fit = fit_camera(views_of(8, 0.0, 1), SIZE, Expectation.of_calibration(SIZE))
    # the lens's high terms are held toward 0 by what is expected of lenses, hence not to the last digit
    np.testing.assert_allclose(fit.camera.camera_matrix, lens_camera.camera_matrix, atol=0.05)
    assert max(fit.view_rms_px) < 2e-3


def test_errors_are_as_large_as_the_covariance_says(views_of, lens_camera):
    normalised = []
    for seed in range(12):
        fit = fit_camera(views_of(8, 0.1, 100 + seed), SIZE, Expectation.of_calibration(SIZE))
        error = parameters(fit) - truth_of(lens_camera)
        normalised.append(error @ np.linalg.solve(fit.covariance, error) / len(NAMES))
        assert fit.stddev_px == pytest.approx(0.1, rel=0.2)
        assert fit.focal_stddev < 0.003
    # a mean of 12 chi squares of 9 degrees: standard deviation 0.14; priors that hold the truth make it smaller
    assert 0.5 < np.mean(normalised) < 1.4


def test_footages_expectation_holds_what_few_views_leave_open(views_of, lens_camera):
    expected = Expectation.of_footage(SIZE)
    fit = fit_camera(views_of(1, 0.02, 7, tilts=(40.0, 41.0)), SIZE, expected)
    assert fit.camera.camera_matrix[0, 0] == fit.camera.camera_matrix[1, 1]
    error = np.log(fit.camera.camera_matrix[1, 1] / lens_camera.camera_matrix[1, 1])
    assert abs(error) < 3.0 * fit.focal_stddev < 0.06


def test_pixels_that_are_not_square_keep_their_stated_shape(views_of):
    expected = Expectation.of_footage(SIZE, pixel_aspect=4 / 3)
    squeezed = [TargetView(v.name, v.points_mm, v.pixels * [0.75, 1.0]) for v in views_of(6, 0.02, 8)]
    matrix = fit_camera(squeezed, SIZE, expected).camera.camera_matrix
    # a pixel 4/3 as wide as high: as many fewer of them to the same angle
    assert matrix[0, 0] / matrix[1, 1] == pytest.approx(0.75, rel=1e-12)


@pytest.mark.parametrize(("tilts", "alike"), [((0.0, 1.0), False), ((0.0, 0.1), True)], ids=["above", "alike"])
def test_views_that_do_not_determine_the_focal_length_leave_it_open(views_of, tilts, alike):
    fit = fit_camera(views_of(8, 0.1, 3, tilts, alike), SIZE, Expectation.of_calibration(SIZE))
    assert fit is None or fit.focal_stddev > 0.02


def test_a_tenth_of_wild_points_does_not_move_the_camera(views_of, lens_camera):
    views = views_of(8, 0.05, 4)
    rng = np.random.default_rng(0)
    for view in views:
        wild = rng.choice(len(GRID), 3, replace=False)
        view.pixels[wild] += rng.uniform(-15, 15, (3, 2))
    fit = fit_camera(views, SIZE, Expectation.of_calibration(SIZE))
    assert abs(np.log(fit.camera.camera_matrix[1, 1] / lens_camera.camera_matrix[1, 1])) < 0.003


def test_points_on_a_line_are_no_view():
    line = np.column_stack([np.linspace(-50, 50, 12), np.zeros(12)])
    view = TargetView("line", line, np.column_stack([np.linspace(100, 500, 12), np.full(12, 240.0)]))
    fit = fit_camera([view], SIZE, Expectation.of_calibration(SIZE))
    assert fit is None or not fit.focal_stddev < 0.02
