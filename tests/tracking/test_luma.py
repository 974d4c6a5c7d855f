"""Codes and their light, against the frame's own conversion."""

import numpy as np
import pytest

from arlight.radiometry import Radiometry
from arlight.tracking.luma import luma_codes, luma_plane
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat, chroma_offset_px

SHAPE = (6, 8)


def frame_in(format_: PixelFormat, seed: int = 3) -> Frame:
    """Every luma between black and white, neutral chroma."""
    generator = np.random.default_rng(seed)
    black, white = format_.luma_code_range
    luma = generator.integers(int(black), int(black + white) + 1, SHAPE).astype(format_.dtype)
    if format_.plane_count == 1:
        return Frame(0, 0.0, (luma,), format_)
    chroma_shape = format_.chroma_size(SHAPE[::-1])[::-1]
    chroma = np.full(chroma_shape, format_.chroma_code_range[0], format_.dtype)
    return Frame(0, 0.0, (luma, luma, luma) if format_.matrix == "rgb" else (luma, chroma, chroma), format_)


def formats():
    sited = {"chroma_shift": (1, 1), "chroma_offset_px": chroma_offset_px("left", (1, 1))}
    return {
        "video": PixelFormat("bt709", False, 8, **sited),
        "jpeg": PixelFormat("bt601", True, 8, transfer="bt709", **sited),
        "ten bits": PixelFormat("bt2020", False, 10, transfer="hlg", **sited),
        "grey": PixelFormat("gray", True, 8, transfer="gamma22"),
        "limited grey": PixelFormat("gray", False, 8),
        "deep grey": PixelFormat("gray", True, 12, transfer="linear"),
        "rgb": PixelFormat("rgb", True, 8, transfer="linear"),
    }


@pytest.mark.parametrize("name", formats())
def test_every_code_means_the_light_that_the_frame_says(name):
    frame = frame_in(formats()[name])
    codes, table = luma_codes(frame)
    assert codes.dtype == np.uint8
    assert codes.shape == SHAPE
    assert table.shape == (256,)
    # half a code of eight bits, times the steepest of the curves
    tolerance = 1e-5 if frame.format.bit_depth == 8 else 0.5 / 255 * 5
    np.testing.assert_allclose(table[codes], frame.linear_luma(), atol=tolerance)


@pytest.mark.parametrize("name", formats())
def test_the_plane_s_own_codes_mean_that_light_too(name):
    frame = frame_in(formats()[name])
    codes, table = luma_plane(frame)
    assert codes.shape == SHAPE
    assert len(table) == (256 if frame.format.matrix == "rgb" else 2**frame.format.bit_depth)
    np.testing.assert_allclose(table[codes], frame.linear_luma(), atol=1e-5)


@pytest.mark.parametrize("name", ["video", "ten bits", "deep grey"])
def test_the_plane_is_not_copied(name):
    frame = frame_in(formats()[name])
    assert np.shares_memory(luma_plane(frame)[0], frame.planes[0])


@pytest.mark.parametrize("name", ["video", "jpeg", "grey", "limited grey"])
def test_an_eight_bit_plane_is_not_copied(name):
    frame = frame_in(formats()[name])
    assert np.shares_memory(luma_codes(frame)[0], frame.planes[0])


def test_codes_beyond_black_and_white_are_clamped():
    _, table = luma_codes(frame_in(formats()["video"]))
    assert np.all(table[:17] == 0.0)
    np.testing.assert_allclose(table[235:], 1.0, atol=1e-6)
    assert np.all(np.diff(table[16:236]) > 0.0)


@pytest.mark.parametrize("name", formats())
def test_the_camera_s_own_curve_goes_before_the_footage_s(name):
    frame = frame_in(formats()[name])
    radiometry = Radiometry(tuple(np.linspace(0.0, 1.0, 33) ** 1.7), black=0.02)
    codes, table = luma_codes(frame, radiometry)
    black, white = frame.format.luma_code_range
    encoded = (frame.planes[0] - black) / white
    # half a code of eight bits where there are more, times the steepest slope
    tolerance = 1e-5 if frame.format.bit_depth == 8 else 0.5 / 255 * 1.8
    np.testing.assert_allclose(table[codes], radiometry.linear(encoded), atol=tolerance)
    assert table.min() < -0.015
