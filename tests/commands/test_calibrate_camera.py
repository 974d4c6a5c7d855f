"""`arlight calibrate camera`, from the printed board to camera.json; the measuring itself is tested in calibration."""

import cv2
import numpy as np
import pytest

from arlight.calibration.camera.charuco import CharucoBoard
from arlight.camera import Camera, Pose
from arlight.commands.calibrate_camera import run
from arlight.commands.options.calibrate_camera import CalibrateCameraOptions
from arlight.errors import ArlightError, CalibrationError, CameraError, OutputError, VideoError
from arlight.probe.layout import design_probe
from arlight.probe.storage import save_probe

FOCAL_PX = 500.0


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """OpenCV's own drawing of the board, seen by a pinhole."""
    folder = tmp_path_factory.mktemp("pictures")
    drawn = CharucoBoard().opencv().generateImage((2000, 1400))
    matrix = np.array([[FOCAL_PX, 0, 319.5], [0, FOCAL_PX, 239.5], [0, 0, 1]])
    texels = np.array([[0.125, 0, -125 + 0.0625], [0, -0.125, 87.5 - 0.0625], [0, 0, 1]])
    paths = []
    for k, (tilt, around) in enumerate([(0.5, 0.0), (0.7, 1.3), (0.6, 2.4), (0.8, 3.6), (0.5, 4.4), (0.7, 5.5)]):
        facing = np.diag([1.0, -1.0, -1.0])
        turn = Pose.from_rvec([tilt * np.cos(around), tilt * np.sin(around), 0.0], np.zeros(3)).rotation
        roll = Pose.from_rvec([0, 0, 0.5 * k], np.zeros(3)).rotation
        pose = Pose(turn @ facing @ roll, np.array([4.0 * k, -5.0, 300.0 + 8 * k]))
        homography = matrix @ np.column_stack([pose.rotation[:, :2], pose.translation]) @ texels
        fine = np.array([[3.0, 0, 1.0], [0, 3.0, 1.0], [0, 0, 1]])
        image = cv2.warpPerspective(drawn, fine @ homography, (1920, 1440), flags=cv2.INTER_AREA, borderValue=128)
        path = folder / f"view{k}.png"
        cv2.imwrite(str(path), cv2.resize(image, (640, 480), interpolation=cv2.INTER_AREA))
        paths.append(path)
    return tuple(paths)


def test_pictures_of_the_board_become_a_camera_file(pictures, tmp_path, capsys):
    output = tmp_path / "camera.json"
    assert run(CalibrateCameraOptions(pictures, output)) == 0
    camera = Camera.load(output)
    assert camera.image_size == (640, 480)
    np.testing.assert_allclose(np.diag(camera.camera_matrix)[:2], FOCAL_PX, rtol=0.003)
    printed = capsys.readouterr().out
    for fact in ("focal length", "principal point", "lens", "reprojection", "6 views", "coverage", str(output)):
        assert fact in printed


def test_the_board_is_printed_without_pictures(tmp_path, capsys):
    path = tmp_path / "board.pdf"
    assert run(CalibrateCameraOptions(board=path)) == 0
    assert path.read_bytes().startswith(b"%PDF")
    assert "250 x 175 mm" in capsys.readouterr().out


@pytest.mark.parametrize("chosen", [slice(0, 1), slice(0, 3)])
def test_views_that_do_not_suffice_leave_an_old_file_as_it_was(pictures, tmp_path, chosen):
    output = tmp_path / "camera.json"
    output.write_text("old")
    with pytest.raises(CalibrationError, match="alike"):
        run(CalibrateCameraOptions(pictures[chosen], output))
    assert output.read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["camera.json"]


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        ({}, CalibrationError, "no pictures.*--board"),
        ({"rows": 6}, CameraError, "odd number of rows"),
        ({"pictures": ("nowhere.mp4",)}, VideoError, "nowhere.mp4"),
        ({"pictures": ("nowhere.png",)}, ArlightError, "nowhere.png"),
        ({"pictures": ("x.png",), "response": True}, CalibrationError, "--probe FILE"),
        ({"pictures": ("x.png",), "camera": "camera.json"}, CalibrationError, "add --response"),
    ],
)
def test_what_cannot_be_measured_is_refused(tmp_path, values, error, message):
    paths = {"pictures": lambda names: tuple(tmp_path / name for name in names), "camera": lambda name: tmp_path / name}
    options = {name: paths.get(name, lambda value: value)(value) for name, value in values.items()}
    with pytest.raises(error, match=message):
        run(CalibrateCameraOptions(**{"output": tmp_path / "out.json"} | options))
    assert not (tmp_path / "out.json").exists()


def test_pictures_without_the_sheet_are_refused(pictures, tmp_path):
    save_probe(design_probe(order=1, pixels_per_mm=4.0), tmp_path / "probe.json")
    with pytest.raises(CalibrationError, match="no picture shows the target"):
        run(CalibrateCameraOptions(pictures[:1], tmp_path / "out.json", probe=tmp_path / "probe.json"))


def test_pictures_are_not_overwritten(pictures):
    with pytest.raises(OutputError, match="overwrite"):
        run(CalibrateCameraOptions(pictures, pictures[0]))


def test_a_board_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(OutputError, match="no such folder"):
        run(CalibrateCameraOptions(board=tmp_path / "none" / "board.pdf"))
