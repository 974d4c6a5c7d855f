"""What the camera sees, against plain geometry and against Mitsuba's own path integrator."""

import numpy as np
import pytest

from arlight.tracking.block_layout import field_blocks
from arlight.validation.block_responses import views_of
from arlight.validation.camera_view import TABLE_REFLECTANCE
from arlight.validation.filming import pose_at, proof_camera, stand_on
from arlight.validation.reference_scene import reference_radiance


@pytest.fixture(scope="module")
def camera():
    return proof_camera()


@pytest.fixture(scope="module")
def pose(camera, small_probe):
    return pose_at(stand_on("orbit", 0.4), camera, small_probe.sheet_mm)


@pytest.fixture(scope="module")
def picture(small_sheet, camera, pose):
    return small_sheet.picture(camera, pose, samples=3)[0]


def pixel(camera, pose, place_mm):
    x, y = np.rint(camera.project(pose, [[*place_mm, 0.0]])[0]).astype(int)
    return y, x


def test_the_wedge_is_where_it_should_be_and_as_bright(picture, camera, pose, small_probe, smooth_light):
    steps = [block for block in small_probe.blocks if block.kind == "wedge"]
    for step in steps:
        expected = step.reflectance * small_probe.paper_reflectance * smooth_light.irradiance() / np.pi
        np.testing.assert_allclose(picture[pixel(camera, pose, step.center_mm)], expected, rtol=1e-4)


def test_the_table_lies_around(picture, smooth_light):
    np.testing.assert_allclose(picture[2, 2], TABLE_REFLECTANCE * smooth_light.irradiance() / np.pi, rtol=1e-5)


def test_a_block_in_the_picture_is_the_block_from_its_direction(picture, small_sheet, camera, pose, small_probe):
    block = next(block for block in field_blocks(small_probe) if block.kind == "clear_white")
    toward = pose.view_directions([*block.center_mm, 0.0])
    alone = small_sheet.radiance(np.array([block.center_mm]), toward)[0]
    np.testing.assert_allclose(picture[pixel(camera, pose, block.center_mm)], alone, rtol=0.01)


def test_mirrors_add_what_fresnel_says_where_all_is_black(small_sheet, small_probe, small_layers, smooth_light):
    block = next(block for block in field_blocks(small_probe) if block.kind == "black_black")
    toward = views_of((40.0,), (20.0,))[0]
    place = np.array([block.center_mm])
    mirrored = small_sheet.radiance(place, toward)[0] - small_sheet.radiance(place, toward, mirrors=False)[0]
    arriving = smooth_light.radiance_at(toward * [-1, -1, 1])
    upper = float(small_layers.slab.interface_reflectance(toward[2]))
    # solid ink leaves 2 % of the film: the lower face adds next to nothing
    np.testing.assert_allclose(mirrored, upper * arriving, rtol=2e-3)


@pytest.mark.usefixtures("fast_path_tracer")
@pytest.mark.parametrize(("kind", "tilt", "azimuth"), [("clear_white", 20.0, -60.0), ("clear_black", 55.0, 30.0)])
def test_two_stages_agree_with_plain_path_tracing(
    small_sheet, small_layers, small_probe, smooth_light, kind, tilt, azimuth
):
    block = next(block for block in field_blocks(small_probe) if block.kind == kind)
    _agrees(small_sheet, small_layers, smooth_light, block, views_of((tilt,), (azimuth,))[0])


@pytest.mark.usefixtures("fast_path_tracer")
def test_stripes_agree_with_plain_path_tracing(small_sheet, small_layers, small_probe, smooth_light):
    block = next(block for block in field_blocks(small_probe) if block.frequency == (1, 0) and block.phase_deg == 90.0)
    _agrees(small_sheet, small_layers, smooth_light, block, views_of((35.0,), (-100.0,))[0])


def _agrees(sheet, layers, light, block, toward):
    grid = np.stack(np.meshgrid(*[(np.arange(32) + 0.5) / 32 - 0.5] * 2), axis=-1).reshape(-1, 2)
    points = np.array(block.center_mm) + block.window_mm * grid
    two_stages = sheet.radiance(points, toward).mean(axis=0)
    plain, error = reference_radiance(layers, light, points, toward, samples=256)
    # four standard errors, and half a per cent for the gaps and the few paths of a test
    assert np.all(np.abs(two_stages - plain) < 4.0 * error + 0.005 * plain)
    assert np.all(error < 0.02 * plain)
