"""The shader against an evaluation of single pixels, ray by ray, from analytic patterns and sums over the light."""

import cv2
import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.optics import Slab
from arlight.synthetic.motion import CameraMotion
from arlight.synthetic.renderer import TABLE_REFLECTANCE, Sampling, SheetRenderer
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.transport import IrradianceMap, LightTransport

pytestmark = pytest.mark.usefixtures("needs_opengl")

INDEX, GLASS_MM = 1.52, 2.44
SLAB = Slab(GLASS_MM, INDEX)
SHEET_MM, WINDOW_MM, PIXELS_PER_MM = 48.0, 36.0, 16.0
CAMERA = Camera((192, 128), [[210.0, 0, 95.0], [0, 208.0, 64.5], [0, 0, 1]], [0.08, -0.1, 0.002, -0.001, 0.02])
MOTION = CameraMotion("still", sheet_width_px=130.0, tilt_deg=48.0)


def in_window(x, y):
    return (np.abs(x) < WINDOW_MM / 2) & (np.abs(y) < WINDOW_MM / 2)


def film_at(x, y):
    return 0.95 * (0.5 + 0.5 * np.cos(2 * np.pi * (x + y) / SLAB.period_mm)) * in_window(x, y)


def paper_at(x, y):
    return 0.9 * (0.5 + 0.5 * np.cos(2 * np.pi * (x + y) / SLAB.period_mm + 1.1))


def layers():
    count = round(SHEET_MM * PIXELS_PER_MM)
    along = (np.arange(count) + 0.5) / PIXELS_PER_MM - SHEET_MM / 2
    x, y = np.meshgrid(along, -along)
    opening = in_window(x, y).astype(np.float32)
    frame = (0.9 * (1 - opening)).astype(np.float32)
    return SheetLayers(
        film_at(x, y).astype(np.float32), paper_at(x, y).astype(np.float32), frame, opening, PIXELS_PER_MM
    )


def smooth_light(seed=0, peak=1.0):
    """A sky of a few broad lobes: smooth, so that a mirror image of it can be compared pixel by pixel."""
    generator = np.random.default_rng(seed)
    rows, columns = np.meshgrid(np.arange(32) + 0.5, np.arange(64) + 0.5, indexing="ij")
    theta, phi = rows * np.pi / 32, columns * 2 * np.pi / 64
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    lobes = generator.normal(size=(3, 3))
    lobes /= np.linalg.norm(lobes, axis=1, keepdims=True)
    radiance = 0.15 + peak * np.exp(4 * (w @ lobes.T - 1)) @ generator.uniform(0.2, 1, (3, 3))
    return Environment(radiance.astype(np.float32), yaw_rad=0.7)


def drawn(environment, pose, sampling=None, second=None, share=0.0, bounces=0):
    renderer = SheetRenderer(layers(), SLAB, CAMERA, sampling or Sampling(0.15, 4))
    transport = LightTransport(layers(), SLAB, bounces)
    renderer.set_light("first", environment, transport.irradiance(environment))
    if second is not None:
        renderer.set_light("second", second, transport.irradiance(second))
    picture = renderer.render(pose, share)
    renderer.release()
    return picture


def face_reflectance(cosine):
    angle = np.arccos(cosine)
    inside = np.arcsin(np.sin(angle) / INDEX)
    s = np.sin(angle - inside) / np.sin(angle + inside)
    p = np.tan(angle - inside) / np.tan(angle + inside)
    return (s**2 + p**2) / 2


def refracted_step(direction):
    """How far to the side a ray toward `direction` (..., 3) moves within the glass, Snell in vectors."""
    normal = np.array([0.0, 0.0, 1.0])
    cosine = direction[..., 2:]
    inside = direction / INDEX + normal * (np.sqrt(1 - (1 - cosine**2) / INDEX**2) - cosine / INDEX)
    return GLASS_MM * inside[..., :2] / inside[..., 2:]


def paper_light(environment, points):
    directions, light = environment.samples()
    step = refracted_step(directions)
    face = face_reflectance(directions[:, 2])
    received = light * (directions[:, 2] * (1 - face) / (1 + face))[:, None]
    x, y = points[:, 0, None] + step[:, 0], points[:, 1, None] + step[:, 1]
    return film_at(x, y) @ received


def seen_in_glass(environment, q, step, face, mirrored):
    """Follow the viewer's rays down through the film, from face to face, until next to nothing is left of them."""
    total, carried, at = np.zeros_like(mirrored), 1 - face, q
    while carried.max() > 1e-5:
        carried = carried * film_at(*at.T)[:, None]
        at = at - step
        below = paper_at(*at.T)[:, None] * paper_light(environment, at) / np.pi
        total += carried * (1 - face) * below
        carried = carried * face
        at = at - step
        carried = carried * film_at(*at.T)[:, None]
        total += carried * (1 - face) * mirrored
        carried = carried * face
    return total


def expected_radiance(environment, pose, pixel, generator):
    """Mean over rays through a pixel's square."""
    at = pixel + (np.stack(np.meshgrid(np.arange(20), np.arange(20)), -1).reshape(-1, 2) + 0.5) / 20 - 0.5
    at += generator.uniform(-0.025, 0.025, at.shape)
    rays = np.concatenate([CAMERA.rays(at), np.ones((len(at), 1))], axis=1) @ pose.rotation
    centre = pose.camera_centre_mm
    q = centre[:2] - rays[:, :2] * centre[2] / rays[:, 2:]
    view = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    face = face_reflectance(view[:, 2])[:, None]
    mirrored = environment.radiance_at(view * [-1, -1, 1])
    glass = face * mirrored + seen_in_glass(environment, q, refracted_step(view), face, mirrored)
    opening = in_window(q[:, 0], q[:, 1])[:, None]
    frame = 0.9 * environment.irradiance() / np.pi
    return np.mean(np.where(opening, glass, frame), axis=0)


@pytest.mark.parametrize("tilt_deg", [0.0, 48.0, 68.0, 77.0])
def test_pixels_equal_rays(tilt_deg):
    environment, generator = smooth_light(), np.random.default_rng(1)
    pose = CameraMotion("still", 130.0, tilt_deg).pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    picture = drawn(environment, pose)
    inside = generator.uniform(-0.42, 0.42, (40, 2)) * SHEET_MM
    pixels = np.rint(CAMERA.project(pose, np.column_stack([inside, np.zeros(40)])))
    found = np.array([picture[int(y), int(x)] for x, y in pixels])
    expected = np.array([expected_radiance(environment, pose, pixel, generator) for pixel in pixels])
    white = 0.9 * environment.irradiance().mean() / np.pi
    # a pixel on the window's edge may differ by what lies between two samples
    assert np.median(np.abs(found - expected)) < 4e-4 * white
    assert np.sqrt(np.mean((found - expected) ** 2)) < 6e-3 * white


def test_lamp_is_mirrored_where_geometry_says():
    pose = MOTION.pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    point = np.array([3.0, -4.0, 0.0])
    toward = pose.view_directions(point) * [-1, -1, 1]
    radiance = np.zeros((256, 512, 3), np.float32)
    row = int(np.arccos(toward[2]) / np.pi * 256)
    column = int(np.arctan2(toward[1], toward[0]) % (2 * np.pi) / (2 * np.pi) * 512)
    radiance[row, column] = 1000.0
    environment = Environment(radiance)
    dark = IrradianceMap(np.zeros((4, 4, 3), np.float32), (-1.0, 1.0), 1.0)
    renderer = SheetRenderer(layers(), SLAB, CAMERA)
    renderer.set_light("first", environment, dark)
    picture = renderer.render(pose)[..., 1]
    renderer.release()
    theta, phi = (row + 0.5) * np.pi / 256, (column + 0.5) * 2 * np.pi / 512
    lamp = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    centre = pose.camera_centre_mm
    # the image of the lamp lies below the sheet: where the ray to it crosses z = 0
    crossing = centre + lamp * [1, 1, -1] * centre[2] / lamp[2]
    expected = CAMERA.project(pose, crossing[None])[0]
    # the mirror of the upper face alone: its brightness does not depend on the film
    weight = np.where(picture > 0.4 * picture.max(), picture, 0.0)
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    found = np.array([np.sum(weight * x), np.sum(weight * y)]) / weight.sum()
    assert np.linalg.norm(found - expected) < 1.0


def test_cross_fade_is_the_mixture_of_both_lights():
    pose = MOTION.pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    first, second = smooth_light(2), smooth_light(3, peak=3.0).rotated(1.0)
    mixed = drawn(first, pose, second=second, share=0.3)
    parts = 0.7 * drawn(first, pose) + 0.3 * drawn(second, pose)
    np.testing.assert_allclose(mixed, parts, atol=2e-5 * parts.max())


def test_turning_camera_and_light_together_changes_nothing():
    """A quarter turn about the normal of everything but the sheet, whose pattern is turned by hand."""
    pose = MOTION.pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    printed = layers()
    turned = SheetLayers(
        *(np.rot90(a).copy() for a in (printed.film, printed.paper, printed.frame, printed.opening)), PIXELS_PER_MM
    )
    pictures = []
    for sheet, light, view in (
        (printed, smooth_light(4), pose),
        (turned, smooth_light(4).rotated(np.pi / 2), Pose(pose.rotation @ quarter.T, pose.translation)),
    ):
        renderer = SheetRenderer(sheet, SLAB, CAMERA)
        renderer.set_light("first", light, LightTransport(sheet, SLAB, 1).irradiance(light))
        pictures.append(renderer.render(view))
        renderer.release()
    corners = np.array([[-22.0, 22, 0], [22, 22, 0], [22, -22, 0], [-22, -22, 0]])
    inside = cv2.fillConvexPoly(
        np.zeros(CAMERA.image_size[::-1], np.uint8), CAMERA.project(pose, corners).astype(int), 1
    )
    difference = (pictures[0] - pictures[1])[inside > 0]
    # 0.5 %: sampling at the window's edge and the coarse directions of light between paper and glass
    assert np.sqrt(np.mean(difference**2)) < 5e-3 * pictures[0].max()


def test_nothing_on_the_sheet_is_brighter_than_uniform_light():
    uniform = Environment(np.full((64, 128, 3), 0.8, np.float32))
    pose = CameraMotion("still", 130.0, 70.0).pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    picture = drawn(uniform, pose, bounces=3)
    assert picture.max() < 0.8 * 1.001
    assert picture.min() > 0.0


def test_table_and_sky_surround_the_sheet():
    environment = smooth_light(5)
    pose = CameraMotion("still", 60.0, 80.0).pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    picture = drawn(environment, pose)
    ray = pose.rotation.T @ np.append(CAMERA.rays([[96.0, 0.0]])[0], 1.0)
    assert ray[2] > 0.0
    np.testing.assert_allclose(picture[0, 96], environment.radiance_at(ray / np.linalg.norm(ray)), rtol=2e-3)
    table = np.array(TABLE_REFLECTANCE) * environment.irradiance() / np.pi
    # the grain changes it by 11 % at most
    np.testing.assert_allclose(picture[-3:].mean(axis=(0, 1)), table, rtol=0.12)


def test_finer_sampling_changes_little():
    environment = smooth_light(6)
    pose = MOTION.pose(0.0, CAMERA, (SHEET_MM, SHEET_MM))
    default, fine = drawn(environment, pose, Sampling()), drawn(environment, pose, Sampling(0.05, 12))
    white = 0.9 * environment.irradiance().mean() / np.pi
    assert np.sqrt(np.mean((default - fine) ** 2)) < 4e-3 * white
