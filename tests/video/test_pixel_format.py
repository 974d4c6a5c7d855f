from dataclasses import replace

import numpy as np
import pytest

from arlight.video.pixel_format import CHROMA_LOCATIONS, PixelFormat, chroma_offset_px, colour_format

YUV = PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5))


@pytest.mark.parametrize(
    ("matrix", "published"),
    [
        # columns Cb and Cr of R', G', B' for full-range values, as the standards print them
        ("bt601", [[0, 1.402], [-0.344136, -0.714136], [1.772, 0]]),
        ("bt709", [[0, 1.5748], [-0.187324, -0.468124], [1.8556, 0]]),
        ("bt2020", [[0, 1.4746], [-0.164553, -0.571353], [1.8814, 0]]),
    ],
)
def test_matrices_are_the_published_ones(matrix, published):
    format_ = replace(YUV, matrix=matrix)
    np.testing.assert_allclose(format_.rgb_from_ycc()[:, 1:], published, atol=2e-6)
    np.testing.assert_allclose(format_.rgb_from_ycc() @ format_.ycc_from_rgb(), np.eye(3), atol=1e-6)


@pytest.mark.parametrize("matrix", ["bt601", "bt709", "bt2020", "fcc", "smpte240m"])
def test_white_has_no_chroma(matrix):
    np.testing.assert_allclose(replace(YUV, matrix=matrix).ycc_from_rgb() @ [1, 1, 1], [1, 0, 0], atol=1e-6)


@pytest.mark.parametrize("depth", [8, 10, 12, 16])
def test_code_ranges_follow_the_depth(depth):
    limited = replace(YUV, bit_depth=depth)
    assert limited.luma_code_range == (2**depth / 16, 219 * 2**depth / 256)
    assert limited.chroma_code_range == (2**depth / 2, 224 * 2**depth / 256)
    assert replace(limited, full_range=True).luma_code_range == (0, 2**depth - 1)


def test_subsampled_sizes_round_up():
    assert YUV.chroma_size((65, 47)) == (33, 24)
    assert replace(YUV, chroma_shift=(2, 0)).chroma_size((65, 47)) == (17, 47)


def test_sites_lie_within_the_pixels_that_share_them():
    assert chroma_offset_px("left", (1, 0)) == (0, 0)
    assert chroma_offset_px("center", (2, 0)) == (1.5, 0)
    for name in CHROMA_LOCATIONS:
        assert chroma_offset_px(name, (0, 0)) == (0, 0)
        assert chroma_offset_px(name, (1, 1)) == CHROMA_LOCATIONS[name]


def test_colour_of_grey_and_rgb():
    grey = PixelFormat("gray", True, 10)
    assert colour_format(grey, (1280, 720)) == PixelFormat("bt709", True, 10, (1, 1), (0.0, 0.5))
    assert colour_format(PixelFormat("rgb", True, 8), (640, 480)) == PixelFormat("bt601", False, 8)
    assert colour_format(YUV, (640, 480)) == YUV


@pytest.mark.parametrize("wrong", [{"matrix": "ycgco"}, {"bit_depth": 7}, {"bit_depth": 17}, {"transfer": "pq"}])
def test_impossible_formats_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        replace(YUV, **wrong)
