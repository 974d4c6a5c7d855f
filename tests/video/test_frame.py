import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.video.frame import Frame, Layer, Region
from arlight.video.pixel_format import PixelFormat, chroma_offset_px

YUV420 = PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5))
FORMATS = {
    "420": YUV420,
    "420 center": replace(YUV420, chroma_offset_px=(0.5, 0.5)),
    "420 topleft 601": replace(YUV420, matrix="bt601", chroma_offset_px=(0.0, 0.0)),
    "422": replace(YUV420, chroma_shift=(1, 0), chroma_offset_px=(0.0, 0.0)),
    "411": replace(YUV420, chroma_shift=(2, 0), chroma_offset_px=(0.0, 0.0)),
    "444 full": PixelFormat("bt601", True, 8),
    "420 10 bit": replace(YUV420, matrix="bt2020", bit_depth=10, transfer="hlg"),
    "rgb": PixelFormat("rgb", True, 8),
    "rgb 12 bit": PixelFormat("rgb", True, 12, transfer="bt709"),
}


def random_frame(format_, size=(36, 28), seed=0, spread=0.4):
    """Codes around mid grey, within `spread` of the range."""
    rng = np.random.default_rng(seed)
    shapes = [size, format_.chroma_size(size), format_.chroma_size(size)][: format_.plane_count]
    top = 2**format_.bit_depth
    low, high = round(top * (0.5 - spread / 2)), round(top * (0.5 + spread / 2))
    return Frame(4, 1.5, tuple(rng.integers(low, high, (h, w)).astype(format_.dtype) for w, h in shapes), format_)


def same_codes(a, b):
    return all(np.array_equal(p, q) for p, q in zip(a.planes, b.planes, strict=True))


@pytest.mark.parametrize("depth", [8, 10])
@pytest.mark.parametrize(
    ("matrix", "cr_r", "cb_g", "cr_g", "cb_b"),
    [
        # the integer formulas as decoders' manuals print them, limited range, 8 bits: 1.164383 (Y - 16) + ...
        ("bt601", 1.596027, 0.391762, 0.812968, 2.017232),
        ("bt709", 1.792741, 0.213249, 0.532909, 2.112402),
        ("bt2020", 1.678674, 0.187326, 0.650424, 2.141772),
    ],
)
def test_limited_range_equals_the_printed_formulas(depth, matrix, cr_r, cb_g, cr_g, cb_b):
    frame = random_frame(PixelFormat(matrix, False, depth), spread=0.9)
    y, cb, cr = (p.astype(float) / 2 ** (depth - 8) for p in frame.planes)
    luma, cb, cr = 1.164383 * (y - 16), cb - 128, cr - 128
    expected = np.stack([luma + cr_r * cr, luma - cb_g * cb - cr_g * cr, luma + cb_b * cb], -1) / 255
    np.testing.assert_allclose(frame.encoded_rgb(), expected.clip(0, 1), atol=3e-6)


def test_full_range_equals_jpegs_formulas():
    frame = random_frame(FORMATS["444 full"], spread=0.9)
    y, cb, cr = (p.astype(float) for p in frame.planes)
    cb, cr = cb - 128, cr - 128
    expected = np.stack([y + 1.402 * cr, y - 0.344136 * cb - 0.714136 * cr, y + 1.772 * cb], -1) / 255
    np.testing.assert_allclose(frame.encoded_rgb(), expected.clip(0, 1), atol=3e-6)


@pytest.mark.parametrize("name", FORMATS)
def test_linear_light_is_the_transfer_of_the_encoded_values(name):
    frame = random_frame(FORMATS[name])
    expected = linear_from_encoded(frame.encoded_rgb(), frame.format.transfer)
    np.testing.assert_allclose(frame.linear_rgb(), expected, atol=2e-6)


@pytest.mark.parametrize("name", FORMATS)
def test_a_region_reads_as_the_same_part_of_the_picture(name):
    frame, region = random_frame(FORMATS[name], size=(37, 29)), Region(5, 3, 32, 28)
    part = np.s_[region.y0 : region.y1, region.x0 : region.x1]
    np.testing.assert_allclose(frame.linear_rgb(region), frame.linear_rgb()[part], atol=1e-6)
    np.testing.assert_array_equal(frame.linear_luma(region), frame.linear_luma()[part])


@pytest.mark.parametrize("shift", [(1, 1), (1, 0), (2, 0)])
@pytest.mark.parametrize("location", ["left", "center", "topleft"])
def test_bilinear_chroma_lies_where_its_site_says(shift, location):
    w, h = 48, 40
    format_ = PixelFormat("bt709", True, 16, shift, chroma_offset_px(location, shift))
    (ox, oy), (cw, ch) = format_.chroma_offset_px, format_.chroma_size((w, h))
    x, y = np.meshgrid(ox + np.arange(cw) * (1 << shift[0]), oy + np.arange(ch) * (1 << shift[1]))
    cr = (32768 + 120 * x - 90 * y).astype(np.uint16)
    frame = Frame(0, 0.0, (np.full((h, w), 32768, np.uint16), np.full((ch, cw), 32768, np.uint16), cr), format_)
    found = (frame.encoded_rgb(chroma="bilinear")[..., 0] - 32768 / 65535) / 1.5748 * 65535
    column, row = np.meshgrid(np.arange(w), np.arange(h))
    np.testing.assert_allclose(found[4:-4, 4:-4], (120 * column - 90 * row)[4:-4, 4:-4], atol=1.0)


def stored_420(encoded, format_):
    """Planes of encoded R'G'B' (h, w, 3), their chroma averaged over the box around each left site."""
    ycc = encoded @ format_.ycc_from_rgb().T
    rows = (ycc[0::2] + ycc[1::2]) / 2
    wide = np.concatenate([rows[:, :1], rows, rows[:, -1:]], axis=1)
    low = (wide[:, 0:-2:2] + 2 * wide[:, 1:-1:2] + wide[:, 2::2]) / 4
    planes = [np.rint(ycc[..., 0] * 219 + 16), *(np.rint(low[..., k] * 224 + 128) for k in (1, 2))]
    return tuple(p.clip(0, 255).astype(np.uint8) for p in planes)


def chroma_errors(linear):
    """(guided, bilinear): worst channel's error of the mean, and rms error, relative to the mean."""
    frame = Frame(0, 0.0, stored_420(encoded_from_linear(linear), YUV420), YUV420)
    inner, results = np.s_[8:-8, 8:-8], []
    for mode in ("guided", "bilinear"):
        difference = (frame.linear_rgb(chroma=mode) - linear)[inner]
        bias = np.abs(difference.mean((0, 1)) / linear[inner].mean((0, 1))).max()
        results.append((bias, np.sqrt(np.mean(difference**2)) / linear.mean()))
    return results


@pytest.mark.parametrize("light", [(1.0, 0.6, 0.3), (0.3, 0.45, 1.0)])
@pytest.mark.parametrize("period_px", [3.0, 4.0, 5.3, 8.0])
def test_guided_chroma_keeps_the_light_of_coloured_stripes(light, period_px):
    y, x = np.mgrid[:96, :128]
    phase = 2 * np.pi * (x * np.cos(0.4) + y * np.sin(0.4)) / period_px
    grey = 0.02 + 0.85 * (1 + np.cos(phase)) / 2 * (1 + np.cos(phase + 1)) / 2
    guided, bilinear = chroma_errors(grey[..., None] * np.array(light))
    # what is left is the rounding of chroma to bytes, 3 per cent of the weakest channel
    assert guided[0] < 0.03
    assert guided[0] < bilinear[0] / 2
    assert guided[1] < bilinear[1] / 3


@pytest.mark.parametrize("blur_px", [0.0, 1.5, 3.0])
def test_guided_chroma_is_not_much_worse_where_colours_are_independent(blur_px):
    noise = gaussian_filter(np.random.default_rng(2).normal(size=(96, 128, 3)), (blur_px, blur_px, 0))
    guided, bilinear = chroma_errors(np.clip(0.35 + 0.15 * noise / noise.std(), 0, 1))
    assert guided[1] < 1.8 * bilinear[1]


def test_guided_chroma_leaves_grey_grey():
    rng = np.random.default_rng(3)
    neutral = np.full((20, 24), 128, np.uint8)
    frame = Frame(0, 0.0, (rng.integers(0, 256, (40, 48)).astype(np.uint8), neutral, neutral), YUV420)
    assert np.ptp(frame.encoded_rgb(), axis=2).max() < 1e-6


@pytest.mark.parametrize("name", FORMATS)
def test_the_frames_own_light_changes_no_code(name):
    # up to codes whose colour does not exist, too
    frame, region = random_frame(FORMATS[name], spread=0.98), Region(3, 5, 30, 22)
    assert same_codes(frame.with_linear_rgb(region, frame.linear_rgb(region)), frame)


@pytest.mark.parametrize("name", FORMATS)
def test_what_is_written_does_not_depend_on_the_region_around_it(name):
    frame, small, large = random_frame(FORMATS[name]), Region(9, 7, 20, 18), Region(2, 1, 35, 27)
    new = np.random.default_rng(6).uniform(0, 1, (11, 11, 3)).astype(np.float32)
    around = frame.linear_rgb(large)
    around[6:17, 7:18] = new
    assert same_codes(frame.with_linear_rgb(small, new), frame.with_linear_rgb(large, around))


@pytest.mark.parametrize("shift", [(1, 1), (2, 0), (2, 2)])
@pytest.mark.parametrize("size", [(61, 45), (34, 27)])
def test_nor_on_how_much_of_the_picture_is_covered(size, shift):
    """Anywhere, also at edges that cut a chroma sample short: what has no coverage is as good as outside."""
    rng, (w, h) = np.random.default_rng(12), size
    frame = random_frame(replace(YUV420, chroma_shift=shift, chroma_offset_px=(0.0, 0.0)), size)
    for _ in range(30):
        (x0, x1), (y0, y1) = np.sort(rng.choice(w + 1, 2, False)), np.sort(rng.choice(h + 1, 2, False))
        over = rng.uniform(0, 1, (y1 - y0, x1 - x0, 4)).astype(np.float32)
        everywhere = np.zeros((h, w, 4), np.float32)
        everywhere[y0:y1, x0:x1] = over
        part = frame.composed(layer=Layer(Region(x0, y0, x1, y1), over))
        assert same_codes(part, frame.composed(layer=Layer(frame.full_region, everywhere)))


@pytest.mark.parametrize("name", FORMATS)
def test_codes_away_from_the_region_stay(name):
    frame, region = random_frame(FORMATS[name]), Region(9, 7, 20, 18)
    changed = frame.with_linear_rgb(region, np.ones((11, 11, 3)))
    for k, (before, after) in enumerate(zip(frame.planes, changed.planes, strict=True)):
        sx, sy = (0, 0) if k == 0 else frame.format.chroma_shift
        outside = np.ones(before.shape, bool)
        reach = 0 if (sx, sy) == (0, 0) else 1
        rows, columns = (slice((a >> s) - reach, (b >> s) + 1 + reach) for a, b, s in ((7, 17, sy), (9, 19, sx)))
        outside[rows, columns] = False
        np.testing.assert_array_equal(before[outside], after[outside])
    assert (changed.index, changed.time_s, changed.format) == (4, 1.5, frame.format)


@pytest.mark.parametrize("name", FORMATS)
def test_flat_light_is_encoded_to_the_nearest_codes(name):
    frame = random_frame(FORMATS[name])
    light = np.array([0.51, 0.22, 0.34], np.float32)
    changed = frame.with_linear_rgb(frame.full_region, np.broadcast_to(light, (*frame.size[::-1], 3)))
    # half a code in each plane, through the matrix's largest row sum (1 + 2.15 at limited range), plus the tables
    half_code = 0.5 / (2**frame.format.bit_depth * 219 / 256)
    found = changed.encoded_rgb(chroma="bilinear")
    expected = encoded_from_linear(light, frame.format.transfer)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=3.2 * half_code + 2e-5)
    assert all(np.ptp(p) == 0 for p in changed.planes)


def test_a_changed_pixel_moves_its_chroma_sample_by_its_own_share_only():
    # random chroma is not what guided upsampling expects: much of each sample is left unexplained by its pixels
    frame = random_frame(YUV420)
    touched = frame.linear_rgb() + np.float32(3e-5)
    one_of_16 = frame.linear_rgb()
    one_of_16[::4, ::4] = touched[::4, ::4]

    def mean_change(linear):
        changed = frame.with_linear_rgb(frame.full_region, linear).planes[1:]
        return np.mean([np.abs(a.astype(int) - b).mean() for a, b in zip(changed, frame.planes[1:], strict=True)])

    assert mean_change(one_of_16) < 0.15 * mean_change(touched)


def test_light_outside_the_range_is_clamped_and_no_number_is_no_change():
    frame = Frame.from_rgb(np.full((7, 4, 3), 100, np.uint8))
    linear = frame.linear_rgb()
    linear[1], linear[2], linear[3, :, 1], linear[4], linear[5] = 7.0, -2.0, np.nan, np.inf, -np.inf
    after = np.stack(frame.with_linear_rgb(frame.full_region, linear).planes, -1)
    np.testing.assert_array_equal(after[:, 0, 1], [100, 255, 0, 100, 255, 0, 100])


def layer_of(region, seed=8):
    """A layer that covers some pixels, some in part."""
    rng = np.random.default_rng(seed)
    w, h = region.size
    coverage = rng.choice([0.0, 0.0, 0.3, 1.0], (h, w, 1))
    return np.concatenate([coverage * rng.uniform(0.1, 0.7, (h, w, 3)), coverage], axis=2).astype(np.float32)


@pytest.mark.parametrize("name", FORMATS)
def test_a_layer_covers_the_light(name):
    frame, region = random_frame(FORMATS[name], size=(90, 41)), Region(7, 5, 84, 36)
    over = layer_of(region)
    linear = frame.linear_rgb(region) * (1 - over[..., 3:]) + over[..., :3]
    expected, found = frame.with_linear_rgb(region, linear), frame.composed(layer=Layer(region, over))
    for a, b in zip(expected.planes, found.planes, strict=True):
        # the same numbers but for the last digit of a product: few lie that near to the middle of two codes
        assert np.abs(a.astype(int) - b).max() <= 1
        assert np.mean(a != b) < 0.002


@pytest.mark.parametrize("name", FORMATS)
def test_a_layer_that_changes_nothing_changes_no_code(name):
    frame, region = random_frame(FORMATS[name], size=(90, 41), spread=0.98), Region(0, 0, 90, 41)
    over = np.zeros((41, 90, 4))
    assert same_codes(frame.composed(layer=Layer(region, over)), frame)
    over[30, 70], over[8, 9] = np.nan, (np.nan, 0.2, 0.2, 1.0)
    assert same_codes(frame.composed(layer=Layer(region, over)), frame)


@pytest.mark.parametrize("name", FORMATS)
def test_a_single_changed_pixel_is_where_it_belongs(name):
    format_ = FORMATS[name]
    frame = random_frame(format_, size=(70, 40))
    for x, y in ((0, 0), (69, 39), (33, 17), (34, 18), (0, 20), (50, 0)):
        over = np.zeros((40, 70, 4))
        over[y, x] = (0.9, 0.05, 0.4, 1.0)
        changed = frame.composed(layer=Layer(frame.full_region, over))
        rows, columns = np.nonzero(changed.planes[0] != frame.planes[0])
        assert set(zip(columns.tolist(), rows.tolist(), strict=True)) == {(x, y)}
        for before, after in zip(frame.planes[1:], changed.planes[1:], strict=True):
            rows, columns = np.nonzero(before != after)
            (sx, sy), (ox, oy) = format_.chroma_shift, format_.chroma_offset_px
            assert np.all(np.abs((columns << sx) + ox - x) < (1 << sx))
            assert np.all(np.abs((rows << sy) + oy - y) < (1 << sy))
        one = frame.composed(layer=Layer(Region(x, y, x + 1, y + 1), over[y : y + 1, x : x + 1]))
        assert same_codes(one, changed)


def test_a_layer_of_the_wrong_shape_is_refused():
    frame = random_frame(YUV420)
    with pytest.raises(ValueError, match="over must be"):
        frame.composed(layer=Layer(Region(4, 4, 20, 20), np.ones((16, 16, 3))))
    with pytest.raises(ValueError, match="leaves the picture"):
        frame.composed(layer=Layer(Region(30, 4, 40, 8), np.ones((4, 10, 4))))


def test_grey_reads_as_equal_channels_and_becomes_colour_when_written():
    grey = Frame(0, 0.0, (np.full((9, 13), 120, np.uint8),), PixelFormat("gray", True, 8))
    np.testing.assert_allclose(grey.encoded_rgb(), 120 / 255, atol=1e-6)
    changed = grey.with_linear_rgb(Region(2, 2, 8, 8), np.full((6, 6, 3), (0.6, 0.1, 0.1)))
    assert changed.format == PixelFormat("bt601", True, 8, (1, 1), (0.0, 0.5))
    assert changed.linear_rgb()[5, 5, 0] > 2 * changed.linear_rgb()[5, 5, 2]
    np.testing.assert_allclose(changed.encoded_rgb()[:, 11:], 120 / 255, atol=1e-6)


def test_luma_is_full_range_bytes_without_a_copy_where_it_can_be():
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16)
    full = Frame(0, 0.0, (codes,), PixelFormat("gray", True, 8))
    assert np.shares_memory(full.luma(), codes)
    limited = Frame(0, 0.0, (codes,), PixelFormat("gray", False, 8)).luma()
    np.testing.assert_array_equal(limited, np.rint((codes.astype(float) - 16) / 219 * 255).clip(0, 255))
    ten = Frame(0, 0.0, (np.full((4, 4), 940, np.uint16),), PixelFormat("gray", False, 10)).luma()
    assert ten.dtype == np.uint8
    assert (ten == 255).all()


def test_luma_of_rgb_is_that_of_its_conversion():
    frame = random_frame(FORMATS["rgb"], spread=0.99)
    converted = frame.converted(PixelFormat("bt709", True, 8))
    assert np.abs(frame.luma().astype(int) - converted.planes[0]).max() <= 1
    np.testing.assert_allclose(frame.linear_luma(), linear_from_encoded(frame.luma() / 255), atol=1e-6)


@pytest.mark.parametrize("name", FORMATS)
def test_conversion_to_a_finer_format_loses_nothing_visible(name):
    frame = random_frame(FORMATS[name], spread=0.2)
    fine = PixelFormat("bt709", True, 16, transfer=frame.format.transfer)
    same_matrix = frame.format.matrix == fine.matrix
    expected = frame.encoded_rgb(chroma="bilinear" if same_matrix else "guided")
    np.testing.assert_allclose(frame.converted(fine).encoded_rgb(), expected, atol=5e-5)


def test_frames_are_immutable():
    frame = Frame.from_rgb(np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        frame.planes[0][0, 0] = 1


def test_wrong_shapes_are_refused():
    frame = random_frame(YUV420)
    with pytest.raises(ValueError, match="leaves the picture of 36x28"):
        frame.linear_rgb(Region(0, 0, 37, 28))
    with pytest.raises(ValueError, match="linear must be"):
        frame.with_linear_rgb(Region(0, 0, 4, 4), np.zeros((4, 5, 3)))
    with pytest.raises(ValueError, match="planes"):
        Frame(0, 0.0, frame.planes, replace(YUV420, chroma_shift=(0, 0)))
    with pytest.raises(ValueError, match="uint8"):
        Frame.from_rgb(np.zeros((4, 4, 3)))


def test_regions_clip_and_grow():
    assert Region(-3, 2, 50, 60).clipped((36, 28)) == Region(0, 2, 36, 28)
    assert Region(40, 2, 50, 60).clipped((36, 28)).size == (0, 26)
    assert Region(4, 4, 8, 9).joined(Region(6, 1, 7, 12)) == Region(4, 1, 8, 12)
    assert Region(4, 4, 8, 9).grown(2) == Region(2, 2, 10, 11)
    assert random_frame(YUV420).linear_rgb(Region(5, 5, 5, 9)).shape == (4, 0, 3)


def test_a_frame_that_was_sent_elsewhere_is_the_same_there():
    frame = Frame.from_rgb(np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8), 3, 0.12)
    there = pickle.loads(pickle.dumps(frame))
    assert (there.index, there.time_s, there.format) == (frame.index, frame.time_s, frame.format)
    np.testing.assert_array_equal(there.linear_rgb(), frame.linear_rgb())
    for k, plane in enumerate(there.planes):
        assert there.places.planes[k] == plane.ctypes.data
        assert there.places.strides[k] == plane.strides[0]
