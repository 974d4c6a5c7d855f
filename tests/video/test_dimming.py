"""Light taken away in a picture's own codes, against linear light and back."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import gaussian_filter

from arlight.color import encoded_from_linear
from arlight.video.dimming import NODE_PX, node_box, nodes_of
from arlight.video.frame import Frame, Region, Shade
from arlight.video.pixel_format import PixelFormat

YUV420 = PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5))
FORMATS = {
    "420": YUV420,
    "420 center bt709": replace(YUV420, chroma_offset_px=(0.5, 0.5), transfer="bt709"),
    "422": replace(YUV420, chroma_shift=(1, 0), chroma_offset_px=(0.0, 0.0)),
    "411": replace(YUV420, chroma_shift=(2, 0), chroma_offset_px=(0.0, 0.0)),
    "444 full": PixelFormat("bt601", True, 8),
    "420 10 bit": replace(YUV420, matrix="bt2020", bit_depth=10, transfer="bt709"),
    "420 10 bit hlg": replace(YUV420, matrix="bt2020", bit_depth=10, transfer="hlg"),
    "rgb": PixelFormat("rgb", True, 8),
    "rgb linear": PixelFormat("rgb", True, 8, transfer="linear"),
    "rgb 12 bit": PixelFormat("rgb", True, 12, transfer="gamma28"),
}


def smooth(shape, seed, low, high):
    """Smooth numbers that run from low to high."""
    found = gaussian_filter(np.random.default_rng(seed).normal(size=shape), (*[5.0] * 2, *[0.0] * (len(shape) - 2)))
    return low + (high - low) * (found - found.min()) / (found.max() - found.min())


def picture(format_, size=(90, 42), low=0.1, high=0.7):
    """A smooth picture of muted colours in a format."""
    w, h = size
    shapes = [size, format_.chroma_size(size), format_.chroma_size(size)]
    blank = tuple(np.full(shape[::-1], round(2**format_.bit_depth * 0.5), format_.dtype) for shape in shapes)
    light = smooth((h, w, 1), 1, low, high) * smooth((h, w, 3), 2, 0.8, 1.0)
    return Frame(0, 0.0, blank, format_).with_linear_rgb(Region(0, 0, w, h), light)


def shares(region, seed=3, low=0.3):
    """Smooth shares (3, rows, columns), nearly grey, and 1 in places."""
    rows, columns = nodes_of(region)
    grey = smooth((rows, columns, 1), seed, low, 1.2) * smooth((rows, columns, 3), seed + 1, 0.95, 1.0)
    return np.moveaxis(np.minimum(grey, 1.0), 2, 0)


def at_pixels(region, left):
    """(h, w, 3) of the nodes' shares."""
    y, x = (np.arange(size) / NODE_PX for size in region.size[::-1])
    nodes = tuple(np.arange(count) for count in left.shape[1:])
    return RegularGridInterpolator(nodes, np.moveaxis(left, 0, 2))(np.stack(np.meshgrid(y, x, indexing="ij"), -1))


def codes_apart(a, b):
    return [np.abs(p.astype(int) - q) / 2 ** (a.format.bit_depth - 8) for p, q in zip(a.planes, b.planes, strict=True)]


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("size", [(90, 42), (77, 39)])
def test_dimmed_is_linear_light_times_the_share(name, size):
    frame, region = picture(FORMATS[name], size), Region(8, 4, *size)
    left = shares(region)
    expected = frame.with_linear_rgb(region, frame.linear_rgb(region) * at_pixels(region, left))
    for apart in codes_apart(frame.composed(Shade(region, left)), expected):
        assert apart.max() <= 1.0
        assert apart.mean() < 0.2


@pytest.mark.parametrize("transfer", ["srgb", "bt709", "gamma22", "gamma28", "linear"])
def test_every_level_is_right_to_a_code_from_black_to_white(transfer):
    """Where the curve's toe and its power meet, too."""
    ramp = np.tile(np.arange(256, dtype=np.uint8), (8, 1))
    frame = Frame.from_rgb(np.repeat(ramp[..., None], 3, axis=2), transfer=transfer)
    for share in (0.05, 0.3, 0.5, 0.8, 0.97):
        region = frame.full_region
        found = frame.composed(Shade(region, np.full((3, *nodes_of(region)), share)))
        expected = 255.0 * encoded_from_linear(share * frame.linear_rgb()[0, :, 0], transfer)
        assert np.abs(found.planes[0][3] - expected).max() < 0.75
        assert all(np.array_equal(plane, found.planes[0]) for plane in found.planes)


@pytest.mark.parametrize("name", FORMATS)
def test_nothing_taken_away_changes_no_code(name):
    format_, rng = FORMATS[name], np.random.default_rng(4)
    shapes = [(90, 41), format_.chroma_size((90, 41)), format_.chroma_size((90, 41))]
    planes = tuple(rng.integers(0, 2**format_.bit_depth, shape[::-1]).astype(format_.dtype) for shape in shapes)
    frame = Frame(0, 0.0, planes, format_)
    left = np.ones((3, *nodes_of(frame.full_region)))
    left[0, 2, 3], left[1, 5, 5], left[2, 7] = np.nan, 1.5, np.inf
    assert max(apart.max() for apart in codes_apart(frame.composed(Shade(frame.full_region, left)), frame)) == 0.0


@pytest.mark.parametrize("name", ["420", "422", "444 full", "rgb"])
def test_without_light_all_is_black(name):
    frame = picture(FORMATS[name])
    dark = frame.composed(Shade(frame.full_region, np.zeros((3, *nodes_of(frame.full_region)))))
    assert np.all(dark.linear_rgb() < 1e-3)


def test_shares_multiply():
    frame = picture(YUV420)
    region = frame.full_region
    first, second = np.full((3, *nodes_of(region)), 0.6), shares(region)
    twice = frame.composed(Shade(region, first)).composed(Shade(region, second))
    once = frame.composed(Shade(region, first * second))
    assert max(apart.max() for apart in codes_apart(twice, once)) <= 1.0


def test_only_the_region_is_touched_and_the_frame_itself_stays():
    frame = picture(YUV420)
    before = [plane.copy() for plane in frame.planes]
    region = Region(16, 8, 40, 24)
    found = frame.composed(Shade(region, np.full((3, *nodes_of(region)), 0.5)))
    for scale, old, new, kept in zip((1, 2, 2), before, found.planes, frame.planes, strict=True):
        changed = np.zeros(old.shape, bool)
        changed[8 // scale : 24 // scale, 16 // scale : 40 // scale] = True
        assert np.array_equal(old[~changed], new[~changed])
        assert np.array_equal(old, kept)
    assert np.all(found.planes[0][8:24, 16:40] < before[0][8:24, 16:40])


def test_grey_stays_grey_and_becomes_colour_only_in_its_format():
    grey = Frame(0, 0.0, (np.full((16, 24), 120, np.uint8),), PixelFormat("gray", True, 8))
    found = grey.composed(Shade(grey.full_region, np.full((3, *nodes_of(grey.full_region)), 0.5)))
    assert found.format.plane_count == 3
    assert np.all(found.planes[1] == 128)
    assert np.all(found.planes[0] == found.planes[0][0, 0])


def test_regions_and_shares_that_do_not_fit_are_refused():
    frame = picture(YUV420)
    with pytest.raises(ValueError, match="multiples of 4"):
        frame.composed(Shade(Region(2, 4, 20, 20), np.ones((3, 5, 6))))
    with pytest.raises(ValueError, match="left must be"):
        frame.composed(Shade(Region(4, 4, 20, 20), np.ones((3, 4, 5))))
    with pytest.raises(ValueError, match="leaves the picture"):
        frame.composed(Shade(Region(80, 4, 96, 20), np.ones((3, 5, 5))))


def test_the_box_of_nodes_holds_the_region_and_stays_in_the_picture():
    assert node_box((3, 4, 6, 9), (90, 42)) == (0, 4, 8, 12)
    assert node_box((81, 37, 90, 42), (90, 42)) == (80, 36, 90, 42)
