"""Compiled measuring, against the same written out with numpy for every pixel: rays, Snell's law, least squares."""

import ctypes
from dataclasses import dataclass, fields

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.native import library
from arlight.probe.layout import design_probe
from arlight.tracking import block_kernels
from arlight.tracking.block_kernels import LISTS, SUMS, TINT, BlockKernels, Shared
from arlight.tracking.block_layout import BlockLayout
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat

PROBE = design_probe(order=2)
SLAB = PROBE.slab
LAYOUT = BlockLayout.of_probe(PROBE)
COUNT = len(LAYOUT.half_mm)
LINEAR = PixelFormat("rgb", True, 16, transfer="linear")
EDGE_PX = 1.5
"""What is kept from a block's border beside the blur."""


@dataclass
class Seen:
    """Every pixel's film point and paper point [mm], and the cosine of its view."""

    film: np.ndarray
    paper: np.ndarray
    cosine: np.ndarray

    @classmethod
    def by_snell(cls, camera: Camera, pose: Pose) -> "Seen":
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
        return cls(film[:, :2], paper[:, :2], -rays[:, 2])

    def phase(self, block: int) -> np.ndarray:
        """Of the film's pattern [rad]."""
        return 2 * np.pi * self.film @ LAYOUT.cycles_per_mm[block] + LAYOUT.phase_rad[block]

    def place(self, block: int) -> np.ndarray:
        """(n, 2) where the paper is seen, -1 to 1 over the part that gets light through its own block alone."""
        return (self.paper - LAYOUT.centers_mm[block]) / (LAYOUT.half_mm[block] - SLAB.max_offset_mm)

    def room_px(self, block: int, camera: Camera, pose: Pose, blur_px: float) -> np.ndarray:
        """How far inside the block's usable part each pixel is, by the border that is nearest to it [px]."""
        center, half = LAYOUT.centers_mm[block], LAYOUT.half_mm[block]
        points = np.array([[0, 0], [0.5, 0], [-0.5, 0], [0, 0.5], [0, -0.5]])
        pixels = camera.project(pose, np.column_stack([center + points, np.zeros(5)]))
        mm_per_px = np.linalg.inv(np.column_stack([pixels[1] - pixels[2], pixels[3] - pixels[4]]))
        unit = np.linalg.norm(mm_per_px, axis=1)
        film = (half - np.abs(self.film - center)) / unit - (EDGE_PX + blur_px)
        paper = (1.0 - np.abs(self.place(block))) * (half - SLAB.max_offset_mm) / unit
        return np.minimum(film.min(axis=1), paper.min(axis=1))


def monomials(degree):
    return [(a, b) for a in range(degree + 1) for b in range(degree + 1) if 0 < a + b <= degree]


def design_matrix(phases, places, harmonics, degree):
    """Columns 1, cos, sin, ... and monomials less their mean over the square."""
    waves = [wave(m * phases) for m in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    x, y = places.T
    means = {(a, b): (a % 2 == 0) * (b % 2 == 0) / ((a + 1) * (b + 1)) for a, b in monomials(degree)}
    return np.column_stack([np.ones(len(x)), *waves, *(x**a * y**b - means[a, b] for a, b in monomials(degree))])


def linear_frame(light, camera) -> Frame:
    """A picture of linear light (pixels, 3)."""
    width, height = camera.image_size
    codes = np.rint(np.clip(light, 0.0, 1.0) * 65535).astype(np.uint16).reshape(height, width, 3)
    return Frame(0, 0.0, tuple(np.ascontiguousarray(codes[..., c]) for c in range(3)), LINEAR)


def owner(seen: Seen) -> np.ndarray:
    """Number of the block over whose film each pixel lies, -1 beside all."""
    inside = np.abs(seen.film[:, None] - LAYOUT.centers_mm).max(axis=2) < LAYOUT.half_mm
    return np.where(inside.any(axis=1), inside.argmax(axis=1), -1)


@pytest.fixture(scope="module", params=["straight", "bent"])
def scene(request, camera, bent_camera, look):
    if request.param == "straight":
        return camera, look(20.0, 30.0, 190.0), Seen.by_snell(camera, look(20.0, 30.0, 190.0))
    pose = look(55.0, -70.0, 200.0, roll_deg=25.0)
    return bent_camera, pose, Seen.by_snell(bent_camera, pose)


def measured(camera, pose, light, samples=10**6, blur_px=0.3, **known) -> BlockMeans:
    return BlockMeter(PROBE, camera, samples).measure(linear_frame(light, camera), pose, blur_px, **known)


def test_python_and_compiled_code_agree_on_their_memory():
    sizes = (ctypes.c_int64 * 4).in_dll(library(block_kernels.__file__, "blocks"), "block_memory")
    assert list(sizes) == [ctypes.sizeof(Shared), 4 * SUMS, 4 * TINT, LISTS]


@pytest.mark.parametrize("bent", [False, True])
def test_distortion_is_undone(camera, bent_camera, bent):
    filming = bent_camera if bent else camera
    generator = np.random.default_rng(1)
    pixels = generator.uniform((0, 0), np.array(filming.image_size) - 1.0, (160, 2))
    kernels = BlockKernels(LAYOUT, filming, 100)
    rays = kernels.rays(pixels, 20 if bent else 0)
    # a thousandth of a pixel
    np.testing.assert_allclose(rays, filming.rays(pixels), atol=1.6e-6)


def test_every_pixel_inside_the_window_is_used_and_none_outside(scene):
    camera, pose, seen = scene
    blur_px = 0.3
    means = measured(camera, pose, np.full((len(seen.film), 3), 0.4), blur_px=blur_px)
    checked = 0
    for block in np.flatnonzero(means.samples > 0):
        room = seen.room_px(block, camera, pose, blur_px)
        # borders are drawn straight from corner to corner, and slopes are the block's mean ones
        assert np.sum(room > 0.2) <= means.samples[block] <= np.sum(room > -0.2)
        checked += np.sum(room > 0.2)
    assert checked > 10_000
    unseen = np.flatnonzero(means.samples == 0)
    assert all(np.sum(seen.room_px(block, camera, pose, blur_px) > 0.2) < 25 for block in unseen)


def test_fits_are_least_squares_over_the_pixels(scene):
    camera, pose, seen = scene
    generator = np.random.default_rng(2)
    mine = owner(seen)
    harmonics = measured(camera, pose, np.full((len(mine), 3), 0.4)).harmonics
    rows = 0.03 * generator.normal(size=(COUNT, 7, 3))
    rows[:, 0] = generator.uniform(0.3, 0.5, (COUNT, 3))
    slopes = generator.uniform(-0.03, 0.03, (COUNT, 2, 3))
    light = generator.uniform(0.0, 0.9, (len(mine), 3))
    for block in range(COUNT):
        here = mine == block
        matrix = design_matrix(seen.phase(block)[here], seen.place(block)[here], harmonics[block], 1)
        columns = 1 + 2 * harmonics[block]
        light[here] = matrix @ np.concatenate([rows[block, :columns], slopes[block]])
    noise = 0.002 * generator.normal(size=light.shape)
    means = measured(camera, pose, light + noise)
    assert np.count_nonzero(means.valid) > 0.8 * COUNT
    for block in np.flatnonzero(means.valid):
        used = seen.room_px(block, camera, pose, 0.3) > 0.0
        matrix = design_matrix(seen.phase(block)[used], seen.place(block)[used], means.harmonics[block], 1)
        expected, squares, _, _ = np.linalg.lstsq(matrix, (light + noise)[used])
        columns = 1 + 2 * means.harmonics[block]
        covariance = np.linalg.inv(matrix.T @ matrix)[:columns, :columns]
        deviation = 0.002 * np.sqrt(np.diag(covariance))
        # a few pixels at the border may be others
        error = np.abs(means.values[block, :columns] - expected[:columns]) / deviation[:, None]
        assert np.sqrt(np.mean(error**2)) < 0.3
        np.testing.assert_allclose(
            means.covariance[block, :columns, :columns], covariance, atol=0.03 * covariance.max()
        )
        np.testing.assert_allclose(means.pixel_variance[block], squares / (len(used.nonzero()[0])), rtol=0.15)
        np.testing.assert_allclose(means.shading[block], np.hypot(*expected[columns : columns + 2]), atol=2e-3)
        assert np.all(means.values[block, columns:] == 0.0)
        assert np.all(means.covariance[block, columns:] == 0.0)
        assert np.all(means.covariance[block, :, columns:] == 0.0)


def test_the_view_is_averaged_over_the_pixels(scene):
    camera, pose, seen = scene
    means = measured(camera, pose, np.full((len(seen.film), 3), 0.4))
    width, height = camera.image_size
    column, row = np.arange(len(seen.film)) % width, np.arange(len(seen.film)) // width
    for block in np.flatnonzero(means.valid):
        used = seen.room_px(block, camera, pose, 0.3) > 0.0
        b = 2 * np.pi * (seen.film - seen.paper)[used] @ LAYOUT.cycles_per_mm[block]
        cut = min(column[used].min(), row[used].min()) == 0 or column[used].max() == width - 1
        cut |= row[used].max() == height - 1
        # a window that the picture's border cuts is no rectangle; otherwise, pixels at the border may be others
        assert abs(means.view_phasor[block] - np.mean(np.exp(-1j * b))) < (5e-3 if cut else 1e-3)
        assert abs(means.view_cosine[block] - np.mean(seen.cosine[used])) < 2e-4


def test_lamps_beside_the_stripes_leave_mean_and_stripes_alone(camera, look):
    generator = np.random.default_rng(3)
    pose = look(20.0, 30.0, 190.0)
    seen = Seen.by_snell(camera, pose)
    mine = owner(seen)
    light = np.full((len(mine), 3), 0.3)
    rows = np.zeros((COUNT, 7, 3))
    harmonics = measured(camera, pose, light).harmonics
    for block in range(COUNT):
        here, columns = mine == block, 1 + 2 * harmonics[block]
        rows[block, 0] = 0.4
        rows[block, 1:columns] = 0.02
        shading = 0.03 * generator.choice([-1.0, 1.0], (9, 1)) * np.array([1.0, 0.7, 0.4])
        matrix = design_matrix(seen.phase(block)[here], seen.place(block)[here], harmonics[block], 3)
        light[here] = matrix @ np.concatenate([rows[block, :columns], shading])
    means = measured(camera, pose, light)
    assert np.count_nonzero(means.valid) > 0.8 * COUNT
    np.testing.assert_allclose(means.values[means.valid], rows[means.valid], atol=1e-3)
    assert np.all(means.shading[means.valid] > 0.0)


def test_few_pixels_of_a_block_are_chosen_by_chance(camera, look):
    pose = look(30.0, 10.0, 150.0)
    width, height = camera.image_size
    # every other column, and every other row, is bright: evenly spaced pixels would see one kind alone
    column, row = np.arange(width * height) % width, np.arange(width * height) // width
    for stripes in (column % 2, row % 2, (column + row) % 2, column % 3 == 0):
        light = np.repeat((0.3 + 0.15 * stripes)[:, None], 3, axis=1)
        every = BlockMeter(PROBE, camera, 10**6).measure(linear_frame(light, camera), pose, 0.3)
        some = BlockMeter(PROBE, camera, 150).measure(linear_frame(light, camera), pose, 0.3)
        assert every.samples.max() > 400
        assert np.all(some.samples <= 150)
        busy = every.samples > 200
        assert np.all(some.samples[busy] > 100)
        # eight neighbours in a row may all be alike, and are seen from nearly the same direction
        deviation = np.sqrt(8.0 * some.covariance[busy, 0, 0] * every.pixel_variance[busy, 0])
        error = (some.values - every.values)[busy, 0, 0] / deviation
        assert np.sqrt(np.mean(error**2)) < 1.2
        spread = np.sqrt((1.0 - np.abs(every.view_phasor[busy]) ** 2) * 8.0 / some.samples[busy])
        assert np.all(np.abs(some.view_phasor - every.view_phasor)[busy] < 4.0 * spread + 1e-3)


def test_the_same_pixels_are_chosen_in_every_frame(camera, look):
    generator = np.random.default_rng(4)
    pose = look(30.0, 10.0, 150.0)
    light = generator.uniform(0.1, 0.8, (640 * 480, 3))
    meter = BlockMeter(PROBE, camera, 200)
    first, again = (meter.measure(linear_frame(light, camera), pose, 0.3) for _ in range(2))
    for part in fields(BlockMeans):
        np.testing.assert_array_equal(getattr(first, part.name), getattr(again, part.name))


def test_blocks_that_are_not_wanted_are_left_out(scene):
    camera, pose, seen = scene
    light = np.random.default_rng(5).uniform(0.1, 0.8, (len(seen.film), 3))
    wanted = np.random.default_rng(6).random(COUNT) < 0.6
    wanted |= np.array([kind == "clear_white" for kind in (block.kind for block in PROBE.blocks)])[:COUNT]
    every, some = measured(camera, pose, light), measured(camera, pose, light, blocks=wanted)
    assert not np.any(some.valid[~wanted])
    assert np.all(some.samples[~wanted] == 0)
    np.testing.assert_array_equal(some.valid[wanted], every.valid[wanted])
    np.testing.assert_array_equal(some.samples[wanted], every.samples[wanted])
    # which blocks mirror a lamp is judged relative to the brightest of those wanted
    np.testing.assert_allclose(some.values[wanted], every.values[wanted], atol=1e-12)
