"""The three images hold the layers to half a level, on the sheet's pixel grid."""

import numpy as np
import pytest
from PIL import Image

from arlight.errors import OutputError, ProbeError
from arlight.probe.layout import design_probe
from arlight.probe.rasters import read_rasters, render_rasters, write_rasters


@pytest.fixture(scope="module")
def probe():
    return design_probe(1, pixels_per_mm=10.0)


@pytest.fixture(scope="module")
def rasters(probe):
    return render_rasters(probe)


@pytest.fixture
def folder(probe, rasters, tmp_path):
    write_rasters(rasters, probe.pixels_per_mm, tmp_path)
    return tmp_path


def test_round_trip_within_half_a_level(probe, rasters, folder):
    read = read_rasters(probe, folder)
    half_level = 0.5 / 255.0 + 1e-6
    assert np.abs(read.film - rasters.film).max() <= half_level
    assert np.abs(read.paper - rasters.paper).max() <= half_level
    assert np.abs(read.frame - rasters.frame)[~rasters.window].max() <= half_level
    np.testing.assert_array_equal(read.window, rasters.window)


def test_images_are_8_bit_on_one_grid_with_their_resolution(probe, folder):
    width, height = (round(side * 10.0) for side in probe.sheet_mm)
    for name, mode in (("top.png", "L"), ("bottom.png", "L"), ("frame.png", "LA")):
        with Image.open(folder / name) as image:
            assert (image.size, image.mode) == ((width, height), mode)
            assert image.info["dpi"] == pytest.approx((254.0, 254.0), abs=0.1)
    with Image.open(folder / "frame.png") as image:
        alpha = np.asarray(image)[..., 1]
    assert set(np.unique(alpha)) == {0, 255}


def test_images_are_compact(folder):
    for name in ("top.png", "bottom.png", "frame.png"):
        with Image.open(folder / name) as image:
            samples = image.width * image.height
        assert (folder / name).stat().st_size < 0.15 * samples


def test_colour_images_are_read_too(probe, rasters, folder):
    for name in ("top.png", "bottom.png", "frame.png"):
        with Image.open(folder / name) as image:
            image.convert("RGBA" if name == "frame.png" else "RGB").save(folder / name)
    read = read_rasters(probe, folder)
    assert np.abs(read.film - rasters.film).max() <= 0.5 / 255.0 + 1e-6
    np.testing.assert_array_equal(read.window, rasters.window)


@pytest.mark.parametrize("name", ["top.png", "bottom.png", "frame.png"])
def test_missing_or_broken_images_are_refused(probe, folder, name):
    (folder / name).write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    with pytest.raises(ProbeError, match=f"{name}: expected an 8-bit PNG"):
        read_rasters(probe, folder)
    (folder / name).unlink()
    with pytest.raises(ProbeError, match=f"{name}: no such file"):
        read_rasters(probe, folder)


def test_images_of_another_sheet_are_refused(folder):
    with pytest.raises(ProbeError, match=r"top\.png: expected \d+ x \d+ pixels .* found"):
        read_rasters(design_probe(2, pixels_per_mm=10.0), folder)


def test_16_bit_images_are_refused(probe, rasters, folder):
    Image.fromarray((rasters.film * 65535).astype(np.uint16)).save(folder / "top.png")
    with pytest.raises(ProbeError, match="8-bit"):
        read_rasters(probe, folder)


def test_frame_without_alpha_is_refused(probe, folder):
    with Image.open(folder / "frame.png") as image:
        image.convert("L").save(folder / "frame.png")
    with pytest.raises(ProbeError, match=r"frame\.png: expected an image with alpha"):
        read_rasters(probe, folder)


def test_unwritable_folder_is_an_output_error(probe, rasters, tmp_path):
    with pytest.raises(OutputError, match="choose another folder"):
        write_rasters(rasters, probe.pixels_per_mm, tmp_path / "absent")
