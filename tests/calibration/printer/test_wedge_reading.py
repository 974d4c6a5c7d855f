"""The tone curve of a printed wedge is found from pictures of it, and bad pictures are refused."""

import cv2
import numpy as np
import pytest

from arlight.calibration.printer.wedge_reading import read_wedge, tone_of_values, wedge_in_picture
from arlight.color import encoded_from_linear
from arlight.errors import ProbeError
from arlight.probe.assembly import Print
from arlight.probe.wedge import wedge_dots, wedge_shares

MADE = Print(dot_gain=0.12, solid=0.05)
SIZE = (1280, 860)


@pytest.fixture(scope="module")
def page():
    """A printed wedge: dots grow and run together as far as the eye can tell."""
    coverage = cv2.GaussianBlur(wedge_dots(300).astype(np.float32), (0, 0), 3.0)
    return MADE.tone(coverage).astype(np.float32)


def photograph(page, light=(0.5, 0.72), corners=((150, 120), (1120, 90), (1160, 640), (100, 560)), turned=0):
    """A perspective picture, light falling off from right to left, 8-bit sRGB."""
    rows, columns = page.shape
    source = np.float32([[0, 0], [columns, 0], [columns, rows], [0, rows]])
    homography = cv2.getPerspectiveTransform(source, np.roll(np.float32(corners), turned, axis=0))
    # the lens resolves what the pixels do
    sharp = cv2.GaussianBlur(page, (0, 0), 1.0)
    image = cv2.warpPerspective(sharp, homography, SIZE, flags=cv2.INTER_AREA, borderValue=0.8)
    image = image * np.linspace(*light, SIZE[0], dtype=np.float32)
    encoded = np.round(255.0 * encoded_from_linear(image)).astype(np.uint8)
    return np.repeat(encoded[..., None], 3, axis=2)


@pytest.mark.parametrize("turned", [0, 2])
def test_tone_is_measured_from_a_slanted_unevenly_lit_photograph(page, turned):
    reading = wedge_in_picture(photograph(page, turned=turned))
    assert reading.dpi == 300
    np.testing.assert_allclose(reading.values, MADE.tone(wedge_shares()), atol=6e-3)
    tone = tone_of_values(reading.values)
    assert tone.dot_gain == pytest.approx(MADE.dot_gain, abs=3e-3)
    assert tone.solid == pytest.approx(MADE.solid, abs=3e-3)


def test_file_is_read_as_the_picture(page, tmp_path):
    image = photograph(page)
    cv2.imwrite(str(tmp_path / "wedge.png"), image[..., ::-1])
    np.testing.assert_array_equal(read_wedge(tmp_path / "wedge.png").values, wedge_in_picture(image).values)


def test_typed_values_are_as_good_on_any_scale():
    tone = tone_of_values(86.0 * MADE.tone(wedge_shares()))
    value = np.linspace(0.0, 1.0, 31)
    np.testing.assert_allclose(tone.print_of(value), MADE.tone(value), atol=2e-3)
    with pytest.raises(ProbeError, match="28 patches, numbered on the page: expected as many values, found 3"):
        tone_of_values([0.1, 0.5, 1.0])
    with pytest.raises(ProbeError, match="not monotone"):
        tone_of_values(
            np.where(wedge_shares() > 0.5, 1.0, MADE.tone(wedge_shares())) - 0.5 * (wedge_shares() == 12 / 13)
        )


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (lambda page: photograph(page, light=(1.6, 1.6)), "clipped; expose less"),
        (lambda page: photograph(page, light=(0.03, 0.03)), "too dark"),
        (lambda page: photograph(page)[:, ::-1], "four corner markers"),
        (lambda page: photograph(page)[:, :900], "found 2 of them"),
        (lambda _: np.full((400, 600, 3), 128, np.uint8), "found 0 of them"),
        (lambda _: np.zeros((8, 8, 3), np.uint8), "found 0 of them"),
    ],
    ids=["clipped", "dark", "mirrored", "cut off", "grey", "tiny"],
)
def test_pictures_that_tell_nothing_are_refused(page, picture, message):
    with pytest.raises(ProbeError, match=message):
        wedge_in_picture(picture(page))


def test_a_reflection_is_noticed(page):
    image = photograph(page).astype(float)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    lamp = 60.0 * np.exp(-((x - 310) ** 2 + (y - 180) ** 2) / (2 * 40.0**2))
    with pytest.raises(ProbeError, match="same ink but measure"):
        wedge_in_picture(np.clip(image + lamp[..., None], 0, 250).astype(np.uint8))


def test_files_that_are_no_pictures_are_refused(tmp_path):
    with pytest.raises(ProbeError, match=r"absent\.png: no such file"):
        read_wedge(tmp_path / "absent.png")
    (tmp_path / "text.png").write_text("hello")
    with pytest.raises(ProbeError, match=r"text\.png: not a picture"):
        read_wedge(tmp_path / "text.png")
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((50, 50, 3), 99, np.uint8))
    with pytest.raises(ProbeError, match=r"grey\.png: expected the wedge's four corner markers"):
        read_wedge(tmp_path / "grey.png")
