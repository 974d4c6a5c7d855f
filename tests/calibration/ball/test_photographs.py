"""Photographs and their EXIF."""

import numpy as np
import pytest
from PIL import ExifTags, Image
from PIL.TiffImagePlugin import IFDRational as Fraction

from arlight.calibration.ball.photographs import Exposure, PhotographError, load_photographs, read_picture


def write(path, time=None, f_number=None, iso=None, orientation=None, size=(40, 30)):
    codes = np.random.default_rng(0).integers(0, 255, (*size[::-1], 3), dtype=np.uint8)
    picture = Image.fromarray(codes)
    exif = Image.Exif()
    tags = exif.get_ifd(ExifTags.IFD.Exif)
    for tag, value in (
        (ExifTags.Base.ExposureTime, time),
        (ExifTags.Base.FNumber, f_number),
        (ExifTags.Base.ISOSpeedRatings, iso),
    ):
        if value is not None:
            tags[tag] = value
    exif[ExifTags.Base.Make] = "maker"
    if orientation is not None:
        exif[ExifTags.Base.Orientation] = orientation
    picture.save(path, exif=exif)
    return codes


def test_codes_are_read_as_rgb(tmp_path):
    codes = write(tmp_path / "a.png")
    read, exposure = read_picture(tmp_path / "a.png")
    np.testing.assert_array_equal(read, codes)
    assert exposure is None


@pytest.mark.parametrize("suffix", ["jpg", "png"])
def test_exposure_is_read_from_exif(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    write(path, Fraction(1, 250), Fraction(28, 10), 200)
    exposure = read_picture(path)[1]
    assert exposure is not None
    assert exposure.time_s == pytest.approx(1 / 250)
    assert exposure.f_number == pytest.approx(2.8)
    assert exposure.iso == 200


def test_pictures_are_turned_upright(tmp_path):
    write(tmp_path / "a.jpg", orientation=6)
    assert read_picture(tmp_path / "a.jpg")[0].shape == (40, 30, 3)


def test_sensitivity_and_aperture_count_as_time():
    reference = Exposure(0.01, 4.0, 100.0)
    assert Exposure(0.01, 4.0, 400.0).equivalent_s(reference) == pytest.approx(0.04)
    # two stops more open
    assert Exposure(0.01, 2.0, 100.0).equivalent_s(reference) == pytest.approx(0.04)
    assert Exposure(0.01).equivalent_s(reference) == pytest.approx(0.01)


def test_a_bracket_by_sensitivity_is_brought_to_one(tmp_path):
    write(tmp_path / "a.jpg", Fraction(1, 100), None, 100)
    write(tmp_path / "b.jpg", Fraction(1, 100), None, 800)
    times = [p.exposure_s for p in load_photographs([tmp_path / "a.jpg", tmp_path / "b.jpg"])]
    assert times == pytest.approx([0.01, 0.08])


def test_stated_exposures_win_over_exif(tmp_path):
    write(tmp_path / "a.jpg", Fraction(1, 100))
    assert load_photographs([tmp_path / "a.jpg"], (0.5,))[0].exposure_s == 0.5


def test_a_single_picture_needs_no_exposure(tmp_path):
    write(tmp_path / "a.png")
    assert load_photographs([tmp_path / "a.png"])[0].exposure_s == 1.0


def test_missing_exposures_are_named(tmp_path):
    write(tmp_path / "a.jpg", Fraction(1, 100))
    write(tmp_path / "b.png")
    with pytest.raises(PhotographError, match=r"b\.png: no exposure time"):
        load_photographs([tmp_path / "a.jpg", tmp_path / "b.png"])


def test_a_time_for_every_picture(tmp_path):
    write(tmp_path / "a.png")
    with pytest.raises(PhotographError, match="2 times for 1 pictures"):
        load_photographs([tmp_path / "a.png"], (1.0, 2.0))


@pytest.mark.parametrize("content", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n broken"])
def test_what_is_no_picture_is_refused(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(PhotographError, match=r"a\.png"):
        read_picture(tmp_path / "a.png")


def test_a_cut_off_picture_is_refused(tmp_path):
    write(tmp_path / "a.jpg", size=(400, 300))
    whole = (tmp_path / "a.jpg").read_bytes()
    (tmp_path / "a.jpg").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(PhotographError, match=r"a\.jpg"):
        read_picture(tmp_path / "a.jpg")


def test_a_missing_picture_is_refused(tmp_path):
    with pytest.raises(PhotographError, match="no such picture"):
        read_picture(tmp_path / "a.png")


def test_sixteen_bits_are_refused(tmp_path):
    Image.fromarray(np.full((30, 40), 40000, np.uint16)).save(tmp_path / "deep.png")
    with pytest.raises(PhotographError, match="more than 8 bits"):
        read_picture(tmp_path / "deep.png")
