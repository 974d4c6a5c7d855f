from dataclasses import replace

import numpy as np
import pytest

from arlight.video.frame import Frame
from arlight.video.orientation import upright
from arlight.video.pixel_format import CHROMA_LOCATIONS, PixelFormat, chroma_offset_px


def random_planes(format_, size, seed=0):
    rng = np.random.default_rng(seed)
    chroma = format_.chroma_size(size)
    return tuple(rng.integers(40, 216, (h, w), dtype=np.uint8) for w, h in (size, chroma, chroma))


@pytest.mark.parametrize("shift", [(1, 1), (1, 0), (0, 0)])
@pytest.mark.parametrize("location", CHROMA_LOCATIONS)
@pytest.mark.parametrize("size", [(24, 16), (23, 17)])
@pytest.mark.parametrize("turns", [0, 1, 2, 3, -1])
def test_turning_the_planes_turns_the_light(shift, location, size, turns):
    format_ = PixelFormat("bt709", False, 8, shift, chroma_offset_px(location, shift))
    frame = Frame(0, 0.0, random_planes(format_, size), format_)
    planes, turned = upright(frame.planes, format_, 90.0 * turns)
    after = Frame(0, 0.0, planes, turned)
    for chroma in ("bilinear", "guided"):
        expected = np.rot90(frame.linear_rgb(chroma=chroma), turns)
        np.testing.assert_allclose(after.linear_rgb(chroma=chroma), expected, atol=2e-5)


def test_four_quarter_turns_are_none():
    format_ = PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5))
    planes = random_planes(format_, (23, 17))
    turned = planes, format_
    for _ in range(4):
        turned = upright(*turned, 90.0)
    assert turned[1] == format_
    assert all(np.array_equal(a, b) for a, b in zip(turned[0], planes, strict=True))


def test_grey_and_rgb_turn_too():
    image = np.random.default_rng(1).integers(0, 256, (5, 8, 3), dtype=np.uint8)
    frame = Frame.from_rgb(image)
    planes, format_ = upright(frame.planes, frame.format, -90.0)
    np.testing.assert_array_equal(np.stack(planes, -1), np.rot90(image, -1))
    assert replace(format_, matrix="rgb") == frame.format
