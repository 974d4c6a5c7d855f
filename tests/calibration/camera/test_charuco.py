"""The printed page, rasterised from its own drawing operators, photographed through a lens and read back."""

import base64
import re
import zlib

import cv2
import numpy as np
import pytest

from arlight.calibration.camera.camera_calibration import calibrate_views
from arlight.calibration.camera.camera_fit import TargetView
from arlight.calibration.camera.charuco import BoardDetector, CharucoBoard, write_board
from arlight.calibration.camera.sheet_pictures import TargetPicture
from arlight.calibration.camera.view_selection import edge_sharpness
from arlight.errors import CalibrationError, CameraError
from arlight.video.frame import Frame

TEXELS_PER_MM = 8
NUMBER = r"(-?[\d.]+)"
STANDS = [(25, 0), (40, 60), (30, 130), (45, 200), (35, 280), (15, 330), (40, 20), (28, 240)]


def rectangles_mm(path):
    """Black rectangles (left, bottom, width, height) of a page that reportlab wrote, and the page's size."""
    content = path.read_bytes()
    stream = re.search(rb"stream\r?\n(.*?)endstream", content, re.S).group(1)
    drawing = zlib.decompress(base64.a85decode(b"<~" + stream.strip(), adobe=True)).decode("latin-1")
    box = re.search(rb"/MediaBox \[ ?([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+)", content).groups()
    found = np.array(re.findall(rf"{NUMBER} {NUMBER} {NUMBER} {NUMBER} re", drawing), float)
    return found * 25.4 / 72.0, np.array(box, float)[2:] * 25.4 / 72.0


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("board") / "board.pdf"
    write_board(CharucoBoard(), path, "a4")
    return path


@pytest.fixture(scope="module")
def board_print(page, sheet_print):
    """The board cut out of the page, centred."""
    found, _ = rectangles_mm(page)
    left, bottom = found[:, :2].min(axis=0)
    texels = np.full((round(175 * TEXELS_PER_MM), round(250 * TEXELS_PER_MM)), 0.85, np.float32)
    for x, y, width, height in np.rint((found - [left, bottom, 0, 0]) * TEXELS_PER_MM).astype(int):
        texels[len(texels) - y - height : len(texels) - y, x : x + width] = 0.05
    return type(sheet_print)(texels, TEXELS_PER_MM, 0.5)


@pytest.fixture(scope="module")
def pictures(board_print, lens_camera, look, photograph):
    detector = BoardDetector(CharucoBoard())
    found = []
    for k, (tilt, azimuth) in enumerate(STANDS):
        pose = look(tilt, azimuth, 330 + 20 * (k % 3), 40.0 * k, (25.0 * (k % 3 - 1), 15.0 * (k % 2)))
        frame = Frame.from_rgb(photograph(board_print, lens_camera, pose, (0.7, 0.7, 0.6), seed=k))
        view = detector.detect(frame.luma(), f"picture {k}")
        table = np.linspace(0, 1, 256, dtype=np.float32)
        found.append((pose, TargetPicture(view, k, frame.luma(), table, edge_sharpness(frame.luma(), view.pixels))))
    return found


def test_the_page_is_at_true_size(page):
    found, size = rectangles_mm(page)
    np.testing.assert_allclose(size, [297.0, 210.0], atol=0.01)
    squares = found[np.isclose(found[:, 2], 25.0)]
    assert len(squares) == 35
    extent = (squares[:, :2] + squares[:, 2:]).max(axis=0) - squares[:, :2].min(axis=0)
    np.testing.assert_allclose(extent, [250.0, 175.0], atol=1e-3)


def test_corners_lie_where_the_page_has_them(pictures, lens_camera, project):
    for pose, picture in pictures:
        view = picture.view
        assert len(view.pixels) >= 30
        error = view.pixels - project(lens_camera, pose, view.points_mm)
        # the print's texels and the picture's rays are a fifth of a pixel apart
        assert np.median(np.linalg.norm(error, axis=1)) < 0.09


def test_the_camera_is_found_again(pictures, lens_camera):
    calibration = calibrate_views([picture for _, picture in pictures])
    found, truth = calibration.camera.camera_matrix, lens_camera.camera_matrix
    np.testing.assert_allclose(np.diag(found)[:2], np.diag(truth)[:2], rtol=0.003)
    error = (found - truth)[[1, 0, 1], [1, 2, 2]] / [found[1, 1], 1, 1]
    assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(calibration.fit.covariance)[[0, 2, 3]]))
    assert np.median(calibration.fit.view_rms_px) < 0.1
    assert calibration.names == tuple(picture.view.name for _, picture in pictures)
    assert 0.4 < calibration.coverage <= 1.0
    # the lens as a whole, over the part of the picture that the board was in
    pixels = np.concatenate([picture.view.pixels for _, picture in pictures])
    shift = calibration.camera.rays(pixels) - lens_camera.rays(pixels)
    assert np.max(np.abs(shift - shift.mean(axis=0))) * truth[0, 0] < 0.6


@pytest.mark.parametrize("chosen", [slice(0, 0), slice(0, 3)])
def test_too_few_views_are_refused(pictures, chosen):
    with pytest.raises(CalibrationError, match=r"no picture shows the target|views are all alike"):
        calibrate_views([picture for _, picture in pictures[chosen]])


def synthetic(project, camera, poses, size=(640, 480)):
    grid = CharucoBoard().corners_mm
    empty, table = np.zeros(size[::-1], np.uint8), np.linspace(0, 1, 256, dtype=np.float32)
    noise = np.random.default_rng(5)
    views = [
        TargetView(f"v{k}", grid, project(camera, pose, grid) + 0.05 * noise.normal(size=grid.shape))
        for k, pose in enumerate(poses)
    ]
    return [TargetPicture(view, k, empty, table, 1.0) for k, view in enumerate(views)]


def test_views_from_above_are_refused_by_name(look, project, lens_camera):
    poses = [look(0.5, 90.0 * k, 330.0 + 20 * k, 0.0, (10.0 * k, 0.0)) for k in range(8)]
    with pytest.raises(CalibrationError, match=r"straight above.*film the target"):
        calibrate_views(synthetic(project, lens_camera, poses))


def test_views_that_are_alike_are_refused(look, project, lens_camera):
    poses = [look(40.0, 30.0 + 0.02 * k, 330.0) for k in range(20)]
    with pytest.raises(CalibrationError, match="all alike: 1 of 20"):
        calibrate_views(synthetic(project, lens_camera, poses))


def test_pictures_of_different_sizes_are_refused_by_name(look, project, lens_camera):
    poses = [look(40.0, 60.0 * k, 330.0) for k in range(6)]
    found = synthetic(project, lens_camera, poses)
    other = synthetic(project, lens_camera, poses[:1], (320, 240))
    with pytest.raises(CalibrationError, match="differ in size: v0 has 640x480, v0 has 320x240"):
        calibrate_views(found + other)


def test_another_board_than_the_printed_is_refused(look, project, lens_camera):
    found = synthetic(project, lens_camera, [look(40.0, 60.0 * k, 330.0) for k in range(6)])
    for picture in found:
        picture.view.points_mm[:] = picture.view.points_mm * [1.0, 1.0] + 6.0 * np.sin(picture.view.points_mm[:, ::-1])
    with pytest.raises(CalibrationError, match="does not fit the pictures"):
        calibrate_views(found)


def test_large_pictures_are_searched_small_and_refined_large(pictures, lens_camera, project):
    pose, picture = pictures[0]
    large = cv2.resize(picture.luma, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)
    view = BoardDetector(CharucoBoard()).detect(large, "large")
    expected = (project(lens_camera, pose, view.points_mm) + 0.5) * 4 - 0.5
    assert np.median(np.linalg.norm(view.pixels - expected, axis=1)) < 4 * 0.09


def test_a_picture_without_the_board_shows_nothing():
    assert BoardDetector(CharucoBoard()).detect(np.full((240, 320), 90, np.uint8), "wall") is None


@pytest.mark.parametrize(
    "values", [(10, 6, 25.0), (2, 7, 25.0), (10, 1, 25.0), (101, 101, 2.0), (10, 7, 0.0), (10, 7, -3)]
)
def test_boards_that_cannot_be_read_are_refused(values):
    with pytest.raises(CameraError, match="board"):
        CharucoBoard(*values)


def test_a_board_larger_than_the_page_is_refused(tmp_path):
    with pytest.raises(CameraError, match="does not fit A4"):
        write_board(CharucoBoard(square_mm=40.0), tmp_path / "board.pdf", "a4")
    assert not (tmp_path / "board.pdf").exists()
