import av
import numpy as np
import pytest

from arlight.errors import VideoError
from arlight.video.pixel_format import PixelFormat
from arlight.video.reader import planes_of
from arlight.video.stream_format import ColourTags, chroma_location, pixel_format, planar_name, tags_of

UNTAGGED = ColourTags(2, 0, 2, 2)


@pytest.mark.parametrize(
    ("name", "planar"),
    [
        ("yuv420p", "yuv420p"), ("yuvj422p", "yuvj422p"), ("yuva444p10le", "yuva444p10le"), ("gbrp12le", "gbrp12le"),
        ("gray", "gray"), ("gray10le", "gray10le"), ("nv12", "yuv420p"), ("nv21", "yuv420p"), ("yuyv422", "yuv422p"),
        ("p010le", "yuv420p10le"), ("p216le", "yuv422p16le"), ("y210le", "yuv422p10le"), ("nv24", "yuv444p"),
        ("yuv420p10be", "yuv420p10le"), ("rgb24", "gbrp"), ("bgra", "gbrp"), ("pal8", "gbrp"), ("rgb48le", "gbrp16le"),
        ("x2rgb10le", "gbrp10le"), ("gbrpf32le", "gbrp16le"), ("ya8", "gray"), ("monob", "gray"),
        ("ya16le", "gray16le"), ("rgb565le", "gbrp"), ("uyyvyy411", "yuv411p"), ("grayf32le", "gray16le"),
    ],
)  # fmt: skip
def test_every_layout_has_a_planar_one_of_at_least_its_depth(name, planar):
    assert planar_name(name) == planar


def test_layouts_that_are_repacked_keep_their_codes():
    rng = np.random.default_rng(0)
    for name, shape in (("rgb24", (16, 24, 3)), ("bgra", (16, 24, 4)), ("nv12", (24, 24)), ("yuyv422", (16, 24, 2))):
        codes = rng.integers(16, 236, shape).astype(np.uint8)
        frame = av.VideoFrame.from_ndarray(codes, name)
        format_ = pixel_format(planar_name(name), UNTAGGED, None, (24, 16), "rawvideo")
        planes = planes_of(frame, format_)
        expected = {
            "rgb24": lambda c: (c[..., 0], c[..., 1], c[..., 2]),
            "bgra": lambda c: (c[..., 2], c[..., 1], c[..., 0]),
            "nv12": lambda c: (c[:16], c[16:, 0::2], c[16:, 1::2]),
            "yuyv422": lambda c: (c[..., 0], c[:, 0::2, 1], c[:, 1::2, 1]),
        }[name](codes)
        assert all(np.array_equal(a, b) for a, b in zip(planes, expected, strict=True)), name


@pytest.mark.parametrize(
    ("name", "tags", "location", "size", "codec", "expected"),
    [
        ("yuv420p", (2, 0, 2, 2), None, (1280, 720), "h264", ("bt709", False, 8, (1, 1), (0.0, 0.5), "srgb")),
        ("yuv420p", (2, 0, 2, 2), None, (720, 576), "h264", ("bt601", False, 8, (1, 1), (0.0, 0.5), "srgb")),
        ("yuv420p", (2, 0, 2, 2), None, (720, 1280), "h264", ("bt709", False, 8, (1, 1), (0.0, 0.5), "srgb")),
        ("yuv420p", (1, 1, 1, 1), "center", (64, 48), "h264", ("bt709", False, 8, (1, 1), (0.5, 0.5), "bt709")),
        ("yuv420p10le", (9, 1, 18, 9), "topleft", (64, 48), "hevc", ("bt2020", False, 10, (1, 1), (0.0, 0.0), "hlg")),
        ("yuvj422p", (5, 2, 2, 2), "center", (64, 48), "mjpeg", ("bt601", True, 8, (1, 0), (0.5, 0.0), "srgb")),
        ("yuv444p12le", (6, 2, 13, 1), None, (64, 48), "hevc", ("bt601", True, 12, (0, 0), (0.0, 0.0), "srgb")),
        ("gbrap", (0, 2, 8, 1), None, (64, 48), "ffv1", ("rgb", True, 8, (0, 0), (0.0, 0.0), "linear")),
        ("gbrp", (0, 1, 13, 1), None, (64, 48), "h264", ("rgb", False, 8, (0, 0), (0.0, 0.0), "srgb")),
        ("gray", (2, 0, 2, 2), None, (64, 48), "ffv1", ("gray", True, 8, (0, 0), (0.0, 0.0), "srgb")),
        ("gray", (2, 0, 2, 2), None, (64, 48), "h264", ("gray", False, 8, (0, 0), (0.0, 0.0), "srgb")),
        ("gray10le", (2, 2, 4, 2), None, (64, 48), "hevc", ("gray", True, 10, (0, 0), (0.0, 0.0), "gamma22")),
    ],
)
def test_tags_are_read(name, tags, location, size, codec, expected):
    assert pixel_format(name, ColourTags(*tags), location, size, codec) == PixelFormat(*expected)


@pytest.mark.parametrize("tags", [ColourTags(8, 1, 1, 1), ColourTags(1, 1, 16, 9)])
def test_colour_that_is_not_understood_is_refused(tags):
    with pytest.raises(VideoError, match=r"not understood.*convert"):
        pixel_format("yuv420p", tags, None, (64, 48), "h264")


def test_a_sources_own_numbers_are_kept_where_they_mean_the_same():
    format_ = PixelFormat("bt601", False, 8, (1, 1), (0.0, 0.5), "bt709")
    assert tags_of(format_, ColourTags(6, 1, 6, 6)) == (6, 1, 6, 6)
    assert tags_of(format_, ColourTags(1, 2, 13, 9)) == (5, 1, 1, 9)
    srgb = PixelFormat("bt709", True, 8, (1, 1), (0.0, 0.5))
    assert tags_of(srgb, ColourTags(2, 0, 2, 2)) == (1, 2, 2, 2)
    assert tags_of(srgb, None) == (1, 2, 13, 1)


def test_a_picture_that_does_not_say_where_chroma_lies():
    assert chroma_location(av.VideoFrame(16, 16, "yuv420p")) is None
