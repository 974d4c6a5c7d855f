"""`arlight calibrate known`: lists that must agree, pictures without the sheet, outputs that stay."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from arlight.camera import Camera
from arlight.commands.calibrate_known import run
from arlight.commands.options.calibrate_known import CalibrateKnownOptions
from arlight.commands.options.footage import SheetAndCamera
from arlight.errors import ArlightError, CalibrationError, CameraError, EnvironmentMapError, OutputError
from arlight.probe.layout import design_probe
from arlight.probe.storage import save_probe


@pytest.fixture
def folder(tmp_path):
    save_probe(design_probe(order=1), tmp_path / "probe.json")
    Camera((96, 64), np.array([[90.0, 0, 47.5], [0, 90.0, 31.5], [0, 0, 1]]), np.zeros(5)).save(
        tmp_path / "camera.json"
    )
    generator = np.random.default_rng(0)
    for name in ("a", "b"):
        cv2.imwrite(str(tmp_path / f"{name}.png"), generator.integers(0, 255, (64, 96, 3), np.uint8))
        cv2.imwrite(str(tmp_path / f"{name}.hdr"), generator.random((16, 32, 3)).astype(np.float32))
    return tmp_path


def options(folder: Path, frames=("a.png", "b.png"), environments=("a.hdr", "b.hdr"), **more) -> CalibrateKnownOptions:
    more.setdefault("output", folder / "sheet.calibration.json")
    return CalibrateKnownOptions(
        frames=tuple(folder / name for name in frames),
        environments=tuple(folder / name for name in environments),
        footage=SheetAndCamera(probe=folder / "probe.json", camera=folder / "camera.json"),
        **more,
    )


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"environments": ("a.hdr",)}, "--environments: 1 for 2 --frames"),
        ({"yaws": (10.0,)}, "--yaws: 1 for 2 --frames"),
        ({"exposures": (1.0, 1.0, 1.0)}, "--exposures: 3 for 2 --frames"),
        ({"frames": (), "environments": ()}, "--frames: none given"),
        ({"yaws": (0.0, float("nan"))}, "--yaws: expected finite"),
        ({"exposures": (1.0, 0.0)}, "--exposures above 0"),
        ({"views": 0}, "--views must be 1 or more"),
        ({}, r"a\.png: does not show the sheet"),
    ],
)
@pytest.mark.parametrize("estimator", ["layers", "fixed"])
def test_what_cannot_calibrate_is_refused(folder, changed, message, estimator):
    with pytest.raises(CalibrationError, match=message):
        run(options(folder, **changed, estimator=estimator))
    assert not list(folder.glob("sheet.*"))


def test_missing_environments_and_frames_are_named(folder):
    with pytest.raises(EnvironmentMapError, match=r"c\.hdr"):
        run(options(folder, environments=("a.hdr", "c.hdr")))
    with pytest.raises(ArlightError, match=r"c\.png"):
        run(options(folder, frames=("c.png", "b.png")))


def test_pictures_of_another_size_are_refused(folder):
    cv2.imwrite(str(folder / "b.png"), np.zeros((32, 48, 3), np.uint8))
    with pytest.raises(CameraError, match=r"96x64.*48x32"):
        run(options(folder, frames=("b.png", "a.png")))


def test_no_input_is_overwritten(folder):
    before = (folder / "a.hdr").read_bytes()
    with pytest.raises(OutputError, match="overwrite"):
        run(options(folder, output=folder / "a.hdr"))
    assert (folder / "a.hdr").read_bytes() == before


def test_an_old_calibration_survives_a_failure(folder):
    (folder / "sheet.calibration.json").write_text("old")
    with pytest.raises(CalibrationError):
        run(options(folder))
    assert (folder / "sheet.calibration.json").read_text() == "old"
    assert not list(folder.glob("*partial*"))
