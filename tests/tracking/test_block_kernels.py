"""Compiled loops over pixels, each against the same thing written out with numpy."""

from typing import NamedTuple

import numpy as np
import pytest

from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.probe.layout import design_probe
from arlight.tracking import block_kernels as kernels
from arlight.tracking.block_layout import BlockLayout
from arlight.video.conversion import decoding_table, encoding_table
from arlight.video.pixel_format import PixelFormat

PROBE = design_probe(order=2)
SLAB = PROBE.slab
LAYOUT = BlockLayout.of_probe(PROBE)


def gathered(camera, pose, margin_mm=0.4, stride=1, capacity=300_000):
    """What the kernel lists, with every block's box the whole picture."""
    count = len(LAYOUT.half_mm)
    width, height = camera.image_size
    boxes = np.tile(np.array([0, 0, width, height]), (count, 1))
    plane_from_ray = np.linalg.inv(np.column_stack([pose.rotation[:, :2], pose.translation]))
    pixels, positions = np.full(capacity, -1), np.empty((capacity, 2))
    phases, first, views = np.empty(capacity), np.empty(count + 1, np.int64), np.empty((count, 3))
    kernels.gather(
        boxes, LAYOUT.centers_mm, LAYOUT.half_mm, SLAB.max_offset_mm, np.full((count, 2), margin_mm),
        LAYOUT.cycles_per_mm, LAYOUT.phase_rad, camera.ray_map, plane_from_ray, pose.camera_centre_mm, SLAB.glass_mm,
        SLAB.refractive_index**2, np.full(count, stride), pixels, positions, phases, first, views,
    )  # fmt: skip
    return pixels, positions, phases, first, views


def film_and_paper(camera, pose):
    """Film point, paper point and cosine of the view for every pixel, by refracting each ray with Snell's law."""
    width, height = camera.image_size
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2).astype(float)
    rays = np.column_stack([camera.rays(grid), np.ones(len(grid))]) @ pose.rotation
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    centre = pose.camera_centre_mm
    film = centre - rays * (centre[2] / rays[:, 2:])
    # Snell in vectors: the part along the sheet shrinks by the index, the rest is what is left of a unit vector
    inside = rays / SLAB.refractive_index
    inside[:, 2] = -np.sqrt(1.0 - inside[:, 0] ** 2 - inside[:, 1] ** 2)
    paper = film + inside * (SLAB.glass_mm / -inside[:, 2:])
    np.testing.assert_allclose(paper[:, 2], -SLAB.glass_mm)
    return film[:, :2], paper[:, :2], -rays[:, 2]


@pytest.mark.parametrize(("bent", "view"), [(False, (20.0, 30.0, 190.0)), (True, (60.0, -70.0, 230.0))])
def test_pixels_whose_film_and_paper_point_lie_in_a_block_are_listed(camera, bent_camera, look, bent, view):
    filming, pose, margin_mm = bent_camera if bent else camera, look(*view), 0.4
    pixels, positions, phases, first, views = gathered(filming, pose, margin_mm)
    film, paper, cosine = film_and_paper(filming, pose)
    assert first[-1] > 5000
    for block in range(len(LAYOUT.half_mm)):
        center, half = LAYOUT.centers_mm[block], LAYOUT.half_mm[block]
        room = half - SLAB.max_offset_mm
        outside = np.maximum(
            np.abs(film - center).max(axis=1) - (half - margin_mm), np.abs(paper - center).max(axis=1) - room
        )
        mine = pixels[first[block] : first[block + 1]]
        # rays are kept in single precision: 1e-3 mm leaves room for it
        listed = np.bincount(mine, minlength=len(film))
        assert np.all(listed[outside < -1e-3] == 1)
        assert np.all(listed[outside > 1e-3] == 0)
        place = slice(first[block], first[block + 1])
        np.testing.assert_allclose(positions[place] * room + center, paper[mine], atol=1e-3)
        film_phase = 2 * np.pi * film[mine] @ LAYOUT.cycles_per_mm[block]
        np.testing.assert_allclose(phases[place], film_phase, atol=5e-3)
        view_phase = 2 * np.pi * (film - paper)[mine] @ LAYOUT.cycles_per_mm[block]
        sums = [np.cos(view_phase).sum(), np.sin(view_phase).sum(), cosine[mine].sum()]
        np.testing.assert_allclose(views[block], sums, atol=1e-3 * max(len(mine), 1))


def test_a_stride_keeps_a_pixel_of_four_anywhere_in_its_cell(camera, look):
    pose = look(30.0, 10.0, 200.0)
    every, sparse = gathered(camera, pose), gathered(camera, pose, stride=2)
    width = camera.image_size[0]
    kept, all_pixels = sparse[0][: sparse[3][-1]], every[0][: every[3][-1]]
    assert set(kept) <= set(all_pixels)
    assert len(kept) == pytest.approx(len(all_pixels) / 4, rel=0.1)
    # evenly spaced pixels would alias the stripes: all four places of a cell must occur alike
    places = np.bincount(2 * (kept // width % 2) + kept % width % 2, minlength=4) / len(kept)
    assert np.all(places > 0.15)


def test_a_full_buffer_ends_the_list(camera, look):
    pose = look(30.0, 10.0, 200.0)
    whole, cut = gathered(camera, pose), gathered(camera, pose, capacity=1000)
    assert cut[3][-1] == 1000
    np.testing.assert_array_equal(cut[3], np.minimum(whole[3], 1000))
    np.testing.assert_array_equal(cut[0], whole[0][:1000])


def monomials(degree):
    return [(a, b) for a in range(degree + 1) for b in range(degree + 1) if 0 < a + b <= degree]


def square_mean(a, b):
    """Mean of x^a y^b over the square [-1, 1]^2."""
    return (0.0 if a % 2 else 1.0 / (a + 1)) * (0.0 if b % 2 else 1.0 / (b + 1))


def design_matrix(positions, phases, harmonics, degree):
    """Columns 1, cos, sin, ... and monomials less their mean over the square."""
    waves = [wave(m * phases) for m in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    x, y = positions.T
    shading = [x**a * y**b - square_mean(a, b) for a, b in monomials(degree)]
    return np.column_stack([np.ones(len(x)), *waves, *shading])


def linear_columns(harmonics, degree):
    """Columns of x and y in the design matrix."""
    return [1 + 2 * harmonics + monomials(degree).index(power) for power in ((1, 0), (0, 1))]


class Fitted(NamedTuple):
    """What the compiled fit fills."""

    coefficients: np.ndarray
    covariance: np.ndarray
    variance: np.ndarray
    shading: np.ndarray
    samples: np.ndarray


def fitted(values, used, first, positions, phases, harmonics, degree):
    blocks, rights = len(first) - 1, values.shape[1]
    coefficients, covariance = np.full((blocks, 7, rights), np.nan), np.full((blocks, 7, 7), np.nan)
    variance, shading = np.full((blocks, rights), np.nan), np.full((blocks, rights), np.nan)
    samples = np.full(blocks, -1, np.int64)
    kernels.fit(
        values, used, np.asarray(first), positions, phases, np.asarray(harmonics), np.asarray(degree), coefficients,
        covariance, variance, shading, samples,
    )  # fmt: skip
    return Fitted(coefficients, covariance, variance, shading, samples)


def scattered(generator, counts):
    """Pixels all over their blocks, in random order, with stripes of a random frequency."""
    first = np.concatenate([[0], np.cumsum(counts)])
    positions = generator.uniform(-1, 1, (first[-1], 2))
    angle = generator.uniform(0, 2 * np.pi, len(counts))
    stripes = generator.uniform(5.0, 9.0, (len(counts), 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    phases = np.concatenate([positions[first[i] : first[i + 1]] @ stripes[i] for i in range(len(counts))])
    return first, positions, phases


def test_fit_is_weighted_least_squares_with_a_mask():
    generator = np.random.default_rng(7)
    counts, harmonics, degree = [200, 350, 90, 500], [3, 2, 0, 1], [1, 2, 3, 3]
    first, positions, phases = scattered(generator, counts)
    values = generator.normal(size=(first[-1], 3))
    used = generator.random(first[-1]) < 0.8
    coefficients, covariance, variance, shading, samples = fitted(
        values, used, first, positions, phases, harmonics, degree
    )
    for block in range(len(counts)):
        mine = np.flatnonzero(used[first[block] : first[block + 1]]) + first[block]
        matrix = design_matrix(positions[mine], phases[mine], harmonics[block], degree[block])
        expected, squares, _, _ = np.linalg.lstsq(matrix, values[mine])
        kept = 1 + 2 * harmonics[block]
        assert samples[block] == len(mine)
        np.testing.assert_allclose(coefficients[block, :kept], expected[:kept], atol=1e-9)
        np.testing.assert_allclose(
            covariance[block, :kept, :kept], np.linalg.inv(matrix.T @ matrix)[:kept, :kept], rtol=1e-6, atol=1e-12
        )
        np.testing.assert_allclose(variance[block], squares / (len(mine) - matrix.shape[1]), rtol=1e-8)
        np.testing.assert_allclose(shading[block], np.hypot(*expected[linear_columns(harmonics[block], degree[block])]))
        assert np.all(coefficients[block, kept:] == 0.0)
        assert np.all(covariance[block, kept:] == 0.0)
        assert np.all(covariance[block, :, kept:] == 0.0)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_shading_up_to_the_degree_leaves_mean_and_stripes_alone(degree):
    generator = np.random.default_rng(8)
    # half a block is hidden: only a fit that knows the shading finds the mean of the whole
    first, positions, phases = scattered(generator, [600, 600])
    stripes = np.array([0.4, 0.1, -0.05, 0.02, 0.0, 0.0, 0.01])
    shading = sum(
        generator.normal() * (positions[:, 0] ** a * positions[:, 1] ** b - square_mean(a, b))
        for a, b in monomials(degree)
    )
    values = (design_matrix(positions, phases, 3, 0) @ stripes + shading)[:, None]
    used = positions[:, 0] > -0.1
    fit = fitted(values, used, first, positions, phases, [3, 3], [degree, degree])
    np.testing.assert_allclose(fit.coefficients[..., 0], np.tile(stripes, (2, 1)), atol=1e-9)
    assert np.all(fit.variance < 1e-12)


def test_error_bars_are_those_of_repeated_noise():
    generator = np.random.default_rng(9)
    first, positions, phases = scattered(generator, [150])
    noise = generator.normal(size=(150, 4000)) * 0.03
    fit = fitted(noise, np.ones(150, bool), first, positions, phases, [2], [1])
    assert fit.variance.mean() == pytest.approx(0.03**2, rel=0.02)
    spread = fit.coefficients[0, :5].var(axis=1)
    np.testing.assert_allclose(spread, 0.03**2 * np.diag(fit.covariance[0])[:5], rtol=0.12)


def test_blocks_with_too_few_or_indistinct_pixels_have_no_samples():
    generator = np.random.default_rng(10)
    first, positions, phases = scattered(generator, [3, 0, 200, 200])
    phases[first[2] : first[3]] = 1.3
    positions[first[3] : first[4]] = 0.5
    values = generator.normal(size=(first[-1], 2))
    used = np.ones(first[-1], bool)
    fit = fitted(values, used, first, positions, phases, [1, 1, 1, 0], [1, 1, 1, 1])
    assert np.all(fit.samples == 0)
    for filled in (fit.coefficients, fit.covariance, fit.variance):
        assert np.all(filled == 0.0)


def test_degree_zero_leaves_a_block_as_it_was():
    first, positions, phases = scattered(np.random.default_rng(11), [100, 100])
    values, used = np.ones((200, 1)), np.ones(200, bool)
    fit = fitted(values, used, first, positions, phases, [0, 0], [0, 1])
    assert all(np.all(np.isnan(filled[0])) for filled in (fit.coefficients, fit.covariance, fit.variance, fit.shading))
    assert fit.samples[0] == -1
    assert fit.coefficients[1, 0, 0] == pytest.approx(1.0)


@pytest.mark.parametrize("shift", [(0, 0), (1, 0), (1, 1)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_codes_are_read_where_the_plane_keeps_them(shift, dtype):
    generator = np.random.default_rng(12)
    height, width = 12, 20
    plane = generator.integers(0, np.iinfo(dtype).max, (height >> shift[1], width >> shift[0])).astype(dtype)
    whole = np.repeat(np.repeat(plane, 1 << shift[0], axis=1), 1 << shift[1], axis=0).astype(float)
    pixels = generator.choice(height * width, 50, replace=False)
    out = np.full((50, 3), -1.0)
    kernels.read_codes(plane, *shift, width, pixels, 40, 16.0, 0.25, 1, out)
    np.testing.assert_allclose(out[:40, 1], (whole.ravel()[pixels[:40]] - 16.0) * 0.25)
    assert np.all(out[40:] == -1.0)
    assert np.all(out[:, [0, 2]] == -1.0)


def test_block_average_is_the_mean_and_zero_without_pixels():
    values, first, average = np.random.default_rng(13).normal(size=(30, 4)), np.array([0, 10, 10, 30]), np.empty((3, 4))
    kernels.block_average(values, first, average)
    np.testing.assert_allclose(average, [values[:10].mean(axis=0), np.zeros(4), values[10:].mean(axis=0)])


def test_corrected_chroma_has_the_asked_mean_and_grows_with_the_light():
    generator = np.random.default_rng(14)
    first = np.array([0, 400])
    phases = generator.uniform(0, 2 * np.pi, 400)
    luma = generator.uniform(0.1, 0.8, 400)
    expected = generator.normal(size=(400, 2)) * 0.01
    shift, none = np.array([[0.03, -0.02]]), np.zeros((1, 2, 2))
    ycc = np.column_stack([luma, np.full((400, 2), 9.0)])
    kernels.correct_chroma(ycc, first, phases, expected, shift, none)
    np.testing.assert_array_equal(ycc[:, 0], luma)
    np.testing.assert_allclose((ycc[:, 1:] - expected).mean(axis=0), shift[0], atol=1e-12)
    added = np.abs(ycc[:, 1:] - expected)[np.argsort(luma)]
    assert np.all(np.diff(added, axis=0) >= 0.0)
    swing = np.array([[[0.02, 0.01], [0.0, -0.03]]])
    kernels.correct_chroma(ycc, first, phases, expected, np.zeros((1, 2)), swing)
    turning = np.column_stack([np.cos(phases), np.sin(phases)])
    np.testing.assert_allclose(ycc[:, 1:] - expected, turning @ swing[0].T, atol=1e-12)


@pytest.mark.parametrize("transfer", ["srgb", "bt709", "hlg"])
def test_modelled_chroma_is_that_of_the_models_light_at_each_pixels_phase(transfer):
    generator = np.random.default_rng(17)
    first = np.array([0, 150, 400])
    phases = generator.uniform(0, 2 * np.pi, 400)
    stripes = 0.04 * generator.normal(size=(2, 7, 3))
    stripes[:, 0] = [[0.5, 0.3, 0.25], [0.3, 0.35, 0.6]]
    matrix = PixelFormat("bt709", False, 8).ycc_from_rgb().astype(float)
    waves = np.column_stack([np.ones(400), *(f(m * phases) for m in (1, 2, 3) for f in (np.cos, np.sin))])
    linear = np.concatenate([waves[:150] @ stripes[0], waves[150:] @ stripes[1]])
    ycc = encoded_from_linear(linear, transfer).astype(float) @ matrix.T
    expected = np.empty((400, 2))
    table = encoding_table(transfer)[:-1]
    kernels.modelled_chroma(ycc, first, phases, stripes, matrix, table, expected)
    np.testing.assert_allclose(expected, ycc[:, 1:], atol=2e-4)
    # a pixel in shadow keeps its hue
    dimmed = ycc * 0.8
    kernels.modelled_chroma(dimmed, first, phases, stripes, matrix, table, expected)
    np.testing.assert_allclose(expected, dimmed[:, 1:], atol=2e-4)


def test_of_blocks_of_one_colour_nothing_is_expected_but_their_own_mean():
    generator = np.random.default_rng(18)
    chroma, first = generator.normal(size=(90, 2)), np.array([0, 30, 30, 90])
    flat = chroma.copy()
    kernels.flatten_chroma(first, np.array([True, True, False]), flat)
    assert np.all(flat[:30] == 0.0)
    np.testing.assert_array_equal(flat[30:], chroma[30:])


@pytest.mark.parametrize("transfer", ["srgb", "bt709", "hlg", "gamma28", "linear"])
def test_linearised_pixels_are_the_transfer_functions(transfer):
    generator = np.random.default_rng(15)
    matrix = PixelFormat("bt709", False, 8).rgb_from_ycc().astype(float)
    rgb = generator.uniform(-0.1, 1.1, (500, 3))
    encoded = rgb @ np.linalg.inv(matrix).T
    linear = np.full((500, 3), np.nan)
    kernels.linearise(encoded, 450, matrix, decoding_table(transfer)[:-1], linear)
    np.testing.assert_allclose(linear[:450], linear_from_encoded(rgb[:450], transfer), atol=2e-5)
    assert np.all(np.isnan(linear[450:]))


def test_a_pixel_is_used_while_every_channel_is_below_its_blocks_ceiling():
    generator = np.random.default_rng(16)
    linear, first = generator.random((300, 3)), np.array([0, 120, 120, 300])
    ceiling = np.array([[0.9, 0.8, 0.7], [0.1, 0.1, 0.1], [0.5, 0.95, 1.0]])
    used = generator.random(300) < 0.5
    kernels.below(linear, first, ceiling, used)
    np.testing.assert_array_equal(used, np.all(linear <= np.repeat(ceiling, np.diff(first), axis=0), axis=1))
