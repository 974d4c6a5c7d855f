"""The compiled conversion against the formulas written out, and that it touches nothing but the picture."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.video.frame import Frame, Region
from arlight.video.pixel_format import PixelFormat, chroma_offset_px

YUV420 = PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5))
FORMATS = {
    "420": YUV420,
    "420 topleft": replace(YUV420, chroma_offset_px=(0.0, 0.0)),
    "420 turned": replace(YUV420, chroma_offset_px=(1.0, 0.5)),
    "422": replace(YUV420, chroma_shift=(1, 0), chroma_offset_px=(0.0, 0.0)),
    "440": replace(YUV420, chroma_shift=(0, 1), chroma_offset_px=(0.0, 1.0)),
    "410": replace(YUV420, chroma_shift=(2, 2), chroma_offset_px=chroma_offset_px("center", (2, 2))),
    "444 10 bit": PixelFormat("bt2020", False, 10, transfer="hlg"),
    "420 16 bit": replace(YUV420, full_range=True, bit_depth=16, transfer="gamma22"),
    "rgb": PixelFormat("rgb", True, 8),
}
SIZES = [(1, 1), (2, 1), (1, 3), (3, 2), (5, 9), (37, 26)]


def picture(format_, size, seed=0):
    """Codes within the range, smooth enough that guided chroma is far from both its limits in places."""
    rng = np.random.default_rng(seed)
    shapes = [size, format_.chroma_size(size), format_.chroma_size(size)]
    top = 2**format_.bit_depth
    spans = [(0.1, 0.9), (0.35, 0.65), (0.35, 0.65)]
    return tuple(
        rng.integers(round(a * top), round(b * top), (h, w)).astype(format_.dtype)
        for (w, h), (a, b) in zip(shapes, spans, strict=True)
    )


def values_of(planes, format_):
    """Y', Cb, Cr (or R', G', B') in double precision."""
    (black, span), (neutral, width) = format_.luma_code_range, format_.chroma_code_range
    if format_.matrix == "rgb":
        neutral, width = black, span
    ranges = [(black, span), (neutral, width), (neutral, width)]
    return [(plane.astype(float) - zero) / unit for plane, (zero, unit) in zip(planes, ranges, strict=True)]


def up(length, shift, offset):
    """(length, samples) matrix that interpolates chroma linearly along an axis; the edge is repeated."""
    share, samples = 1 << shift, -(-length >> shift)
    sites = offset + share * np.arange(samples)
    hats = [np.interp(np.arange(length), sites, row) for row in np.eye(samples)]
    return np.stack(hats, axis=1)


def down(length, shift, offset):
    """(samples, length) matrix that averages a box of the share's width around each site; the edge is repeated."""
    share, samples = 1 << shift, -(-length >> shift)
    matrix = np.zeros((samples, length))
    for sample in range(samples):
        low, high = offset + share * sample - share / 2, offset + share * sample + share / 2
        for pixel in range(-4, length + 4):
            overlap = min(pixel + 0.5, high) - max(pixel - 0.5, low)
            matrix[sample, min(max(pixel, 0), length - 1)] += max(overlap, 0.0) / share
    return matrix


def axes(format_, size, kind):
    (sx, sy), (ox, oy) = format_.chroma_shift, format_.chroma_offset_px
    return kind(size[1], sy, oy), kind(size[0], sx, ox).T


def upsampled(planes, format_, guided):
    """Y', Cb, Cr (h, w, 3) at every pixel."""
    luma, cb, cr = values_of(planes, format_)
    size = luma.shape[::-1]
    rows, columns = axes(format_, size, up)
    gain = np.ones_like(luma)
    if guided and format_.chroma_shift != (0, 0):
        low_rows, low_columns = axes(format_, size, down)
        low = rows @ (low_rows @ luma @ low_columns) @ columns
        gain = np.minimum(np.maximum(luma, 0.02) / np.maximum(low, 0.02), 2.0)
    return np.stack([luma, gain * (rows @ cb @ columns), gain * (rows @ cr @ columns)], axis=-1)


@pytest.mark.parametrize("guided", [True, False])
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("name", FORMATS)
def test_light_is_what_the_formulas_say(name, size, guided):
    format_ = FORMATS[name]
    planes = picture(format_, size)
    encoded = upsampled(planes, format_, guided) @ format_.rgb_from_ycc().astype(float).T
    expected = linear_from_encoded(np.clip(encoded, 0.0, 1.0), format_.transfer)
    found = Frame(0, 0.0, planes, format_).linear_rgb(chroma="guided" if guided else "bilinear")
    np.testing.assert_allclose(found, expected, atol=5e-6)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("name", FORMATS)
def test_new_light_becomes_the_codes_that_the_formulas_say(name, size):
    format_ = FORMATS[name]
    planes, rng = picture(format_, size), np.random.default_rng(1)
    frame = Frame(0, 0.0, planes, format_)
    light = frame.linear_rgb()
    changed = rng.uniform(size=light.shape[:2]) < 0.5
    light[changed] = rng.uniform(0.1, 0.6, (changed.sum(), 3))
    own = upsampled(planes, format_, True)
    target = encoded_from_linear(light, format_.transfer) @ format_.ycc_from_rgb().astype(float).T
    new = np.where(changed[..., None], target, own)
    rows, columns = axes(format_, size, down)
    share = rows @ changed @ columns
    stored = values_of(planes, format_)
    found = values_of(frame.with_linear_rgb(frame.full_region, light).planes, format_)
    span = [format_.luma_code_range[1], *[(format_.chroma_code_range if name != "rgb" else (0, 255.0))[1]] * 2]
    expected = [np.where(changed, new[..., 0], stored[0])]
    for k in (1, 2):
        left = stored[k] - rows @ own[..., k] @ columns
        expected.append(np.where(share > 0, rows @ new[..., k] @ columns + (1 - share) * left, stored[k]))
    for a, b, codes in zip(found, expected, span, strict=True):
        # the nearest code, but for the tables' error, which matters at 16 bits only
        assert np.abs(a - b).max() * codes < 0.5 + 5e-6 * codes


@pytest.mark.parametrize("name", FORMATS)
def test_nothing_beside_the_picture_is_read_or_written(name):
    format_, size = FORMATS[name], (37, 26)
    planes = picture(format_, size)
    region = Region(20, 11, 37, 26)
    light = np.random.default_rng(2).uniform(0.0, 1.0, (15, 17, 3)).astype(np.float32)
    results = []
    for filling in (0, np.iinfo(format_.dtype).max):
        framed = [np.full((p.shape[0] + 6, p.shape[1] + 10), filling, p.dtype) for p in planes]
        for outer, plane in zip(framed, planes, strict=True):
            outer[3:-3, 5:-5] = plane
        frame = Frame(0, 0.0, tuple(outer[3:-3, 5:-5] for outer in framed), format_)
        results.append([frame.linear_rgb(region), *frame.with_linear_rgb(region, light).planes])
        assert all((outer[3:-3, 5:-5] == p).all() for outer, p in zip(framed, planes, strict=True))
        assert all((outer[:3] == filling).all() and (outer[:, -5:] == filling).all() for outer in framed)
    for a, b in zip(*results, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("turns", [1, 2, 3])
@pytest.mark.parametrize("name", ["420", "444 10 bit", "rgb"])
def test_planes_in_any_order_of_memory_read_the_same(name, turns):
    format_ = replace(FORMATS[name], chroma_offset_px=(0.5, 0.5) if name == "420" else (0.0, 0.0))
    planes = picture(format_, (12, 12))
    turned = Frame(0, 0.0, tuple(np.rot90(p, turns) for p in planes), format_)
    straight = Frame(0, 0.0, tuple(np.ascontiguousarray(np.rot90(p, turns)) for p in planes), format_)
    np.testing.assert_array_equal(turned.linear_rgb(), straight.linear_rgb())
    for a, b in zip(turned.planes, straight.planes, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("name", FORMATS)
def test_another_format_has_the_codes_that_the_formulas_say(name, size):
    format_ = FORMATS[name]
    planes = picture(format_, size)
    target = PixelFormat("bt601", False, 8, (1, 1), (0.0, 0.5), format_.transfer)
    matrix = target.ycc_from_rgb().astype(float) @ format_.rgb_from_ycc().astype(float)
    image = upsampled(planes, format_, True) @ matrix.T
    rows, columns = axes(target, size, down)
    expected = [image[..., 0], *(rows @ image[..., k] @ columns for k in (1, 2))]
    found = Frame(0, 0.0, planes, format_).converted(target).planes
    for codes, values, (zero, span) in zip(found, expected, ((16, 219), (128, 224), (128, 224)), strict=True):
        assert np.abs(codes - (values * span + zero).clip(0, 255)).max() < 0.501
