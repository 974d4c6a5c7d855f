"""Where blocks lie in the image, against rays traced through the pixels one by one."""

from itertools import pairwise

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import BlockLayout, field_blocks

PROBE = design_probe(order=3)
LAYOUT = BlockLayout.of_probe(PROBE)
VIEWS = {"overhead": (5.0, 20.0, 220.0), "slanted": (55.0, -100.0, 260.0), "far": (35.0, 60.0, 900.0)}


def on_film(camera: Camera, pose: Pose, pixels: np.ndarray) -> np.ndarray:
    """(n, 2) where the rays through pixels (n, 2) meet z = 0 [mm]."""
    rays = np.column_stack([camera.rays(pixels), np.ones(len(pixels))]) @ pose.rotation
    centre = pose.camera_centre_mm
    return (centre - rays * (centre[2] / rays[:, 2:]))[:, :2]


@pytest.fixture(params=VIEWS)
def pose(request, look):
    return look(*VIEWS[request.param])


def test_the_wedge_does_not_measure_light():
    blocks = field_blocks(PROBE)
    assert {block.kind for block in PROBE.blocks} - {block.kind for block in blocks} == {"wedge"}
    assert len(LAYOUT.centers_mm) == len(LAYOUT.half_mm) == len(LAYOUT.cycles_per_mm) == len(blocks)


def test_stripes_have_the_period_of_their_frequency():
    for block, cycles in zip(field_blocks(PROBE), LAYOUT.cycles_per_mm, strict=True):
        u, v = block.frequency or (0, 0)
        np.testing.assert_allclose(cycles * PROBE.slab.period_mm, (u, v), atol=1e-12)


@pytest.mark.parametrize("bent", [False, True])
def test_boxes_hold_every_pixel_that_sees_the_block(pose, camera, bent_camera, bent):
    filming = bent_camera if bent else camera
    view = LAYOUT.view(filming, pose, 0.6)
    width, height = filming.image_size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    film = on_film(filming, pose, pixels.astype(float))
    for center, half, (x0, y0, x1, y1) in zip(LAYOUT.centers_mm, LAYOUT.half_mm, view.boxes, strict=True):
        # a distorted border bows out of its corners' box by less than half a pixel
        mine = pixels[np.all(np.abs(film - center) < half - 0.2, axis=1)]
        assert np.all((mine >= (x0, y0)) & (mine <= (x1, y1)))


@pytest.mark.parametrize("bent", [False, True])
def test_stripe_frequency_is_the_phase_gradient_in_the_image(pose, camera, bent_camera, bent):
    filming = bent_camera if bent else camera
    cycles = LAYOUT.view(filming, pose, 0.6).cycles_per_px
    centres = np.column_stack([LAYOUT.centers_mm, np.zeros(len(LAYOUT.centers_mm))])
    middle = filming.project(pose, centres)
    step = 0.5
    for axis in (0, 1):
        offset = np.eye(2)[axis] * step
        moved = (on_film(filming, pose, middle + offset) - on_film(filming, pose, middle - offset)) / (2 * step)
        expected = np.sum(moved * LAYOUT.cycles_per_mm, axis=1)
        # a block's mean gradient differs from its middle's by perspective's second order
        np.testing.assert_allclose(cycles[:, axis], expected, atol=0.005 * np.abs(cycles).max())


def test_a_blurrier_picture_keeps_as_many_more_pixels_from_the_border(pose, camera):
    sharp, soft = (LAYOUT.view(camera, pose, blur_px).margin_mm for blur_px in (0.5, 2.5))
    assert np.all(sharp > 0.0)
    for block, (center, half) in enumerate(zip(LAYOUT.centers_mm, LAYOUT.half_mm, strict=True)):
        for axis in (0, 1):
            along = np.eye(2)[1 - axis] * half / 2
            lines = [center + np.eye(2)[axis] * (half - margin[block, axis]) for margin in (sharp, soft)]
            points = np.array([[*(line + side * along), 0.0] for line in lines for side in (1, -1)])
            a, b, c, d = camera.project(pose, points)
            tangent = (a - b) / np.linalg.norm(a - b)
            away = (c + d) / 2 - (a + b) / 2
            distance = abs(away[0] * tangent[1] - away[1] * tangent[0])
            assert distance == pytest.approx(2.0, rel=0.06)


def test_only_harmonics_that_pixels_can_tell_from_the_mean_are_fitted(camera, look):
    seen = []
    for distance in (120.0, 250.0, 600.0, 1500.0, 6000.0):
        view = LAYOUT.view(camera, look(30.0, 10.0, distance), 0.6)
        frequency = np.hypot(*view.cycles_per_px.T)
        patterned = np.any(LAYOUT.cycles_per_mm != 0.0, axis=1)
        assert np.all(view.harmonics[~patterned] == 0)
        # a harmonic at one cycle a pixel looks like a constant
        assert np.all(view.harmonics * frequency < 0.95)
        # what is coarser than four pixels is surely seen
        assert np.all(view.harmonics[patterned & (frequency < 0.25)] >= 1)
        seen.append(view.harmonics)
    assert all(np.all(far <= near) for near, far in pairwise(seen))
    assert seen[0].max() > 1
    assert seen[-1].max() == 0


def test_blocks_beside_the_picture_have_boxes_without_pixels(camera, look):
    aside = look(20.0, 0.0, 300.0, off_mm=(2000.0, 0.0))
    width, height = camera.image_size
    x0, y0, x1, y1 = LAYOUT.view(camera, aside, 0.6).boxes.T
    columns = np.minimum(x1, width - 1) - np.maximum(x0, 0) + 1
    rows = np.minimum(y1, height - 1) - np.maximum(y0, 0) + 1
    assert np.all((columns <= 0) | (rows <= 0))
