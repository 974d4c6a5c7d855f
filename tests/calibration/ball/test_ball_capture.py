"""A mirrored ball beside a sheet, photographed by brute force: every ray meets sphere, sheet or table on its own.

Nothing of the program's ball geometry is used to make the pictures. The light is a formula, so that its coefficients
are known by plain summation.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from arlight.calibration.ball.ball_capture import CaptureSettings, capture_ball
from arlight.calibration.ball.ball_outline import BallError
from arlight.calibration.ball.mirror_ball import MapGrid, merge_views
from arlight.calibration.ball.photographs import Photograph, PhotographError
from arlight.camera import Camera, Pose
from arlight.color import encoded_from_linear
from arlight.environment import Environment
from arlight.errors import ProbeError
from arlight.fourier import analyse
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.probe.rasters import render_rasters

CAMERA = Camera(
    (720, 540), np.array([[820.0, 0, 352.0], [0, 818.0, 274.0], [0, 0, 1]]), np.array([-0.08, 0.03, 0, 0, 0])
)
RADIUS = 22.0
BALL = np.array([84.0, -12.0, RADIUS - 2.44])
REFLECTANCE = np.array([0.62, 0.6, 0.55])
TIMES = (1.0, 1 / 4, 1 / 16, 1 / 64)

LAMPS = np.array([[0.5, 0.3, 0.8], [-0.7, 0.2, 0.5], [0.1, -0.9, 0.3]])
LAMPS /= np.linalg.norm(LAMPS, axis=1, keepdims=True)
COLORS = np.array([[12.0, 10.0, 8.0], [3.0, 4.0, 6.0], [2.0, 2.0, 1.0]])
SHARPNESS = np.array([60.0, 25.0, 12.0])


def sky(w: np.ndarray) -> np.ndarray:
    """Radiance (..., 3): three soft lamps over an even room, a dim floor below."""
    lamps = np.exp(SHARPNESS * (w @ LAMPS.T - 1.0)) @ COLORS
    floor = 1.0 / (1.0 + np.exp(-60.0 * w[..., 2:]))
    return 0.12 + floor * (0.1 + lamps)


def true_coefficients(probe: Probe) -> np.ndarray:
    """By summation over ten thousands of directions, evenly spread in height and azimuth."""
    z, phi = np.meshgrid((np.arange(200) + 0.5) / 200, (np.arange(400) + 0.5) / 400 * 2 * np.pi, indexing="ij")
    s = np.sqrt(1 - z**2)
    w = np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1).reshape(-1, 3)
    weight = w[:, 2] * probe.slab.transmittance(w[:, 2]) * 2 * np.pi / len(w)
    return analyse(sky(w) * weight[:, None], probe.slab.light_plane(w), probe.frequencies)


@dataclass
class Scene:
    probe: Probe
    frame: np.ndarray

    def radiance(self, pose: Pose, ball: bool = True, sheet: bool = True, across: int = 3) -> np.ndarray:
        """(h, w, 3) linear picture, `across` x `across` rays a pixel."""
        width, height = CAMERA.image_size
        offsets = (np.arange(across) + 0.5) / across - 0.5
        x, y = np.meshgrid(
            (np.arange(width)[:, None] + offsets).ravel(), (np.arange(height)[:, None] + offsets).ravel()
        )
        rays = CAMERA.rays(np.stack([x, y], axis=-1).reshape(-1, 2))
        toward = np.column_stack([rays, np.ones(len(rays))]) @ pose.rotation
        origin = pose.camera_centre_mm
        colors = self._flat(origin, toward, sheet)
        if ball:
            a, b = np.sum(toward**2, axis=1), 2.0 * toward @ (origin - BALL)
            c = (origin - BALL) @ (origin - BALL) - RADIUS**2
            hit = b * b - 4 * a * c > 0
            s = (-b[hit] - np.sqrt(b[hit] ** 2 - 4 * a[hit] * c)) / (2 * a[hit])
            gradient = 2.0 * (origin + s[:, None] * toward[hit] - BALL)
            ray = toward[hit]
            away = ray - 2.0 * gradient * (np.sum(ray * gradient, 1) / np.sum(gradient**2, 1))[:, None]
            colors[hit] = REFLECTANCE * sky(away / np.linalg.norm(away, axis=1, keepdims=True))
        return colors.reshape(height, across, width, across, 3).mean(axis=(1, 3))

    def _flat(self, origin: np.ndarray, toward: np.ndarray, sheet: bool) -> np.ndarray:
        reach = -origin[2] / np.minimum(toward[:, 2], -1e-6)
        x, y = origin[0] + reach * toward[:, 0], origin[1] + reach * toward[:, 1]
        colors = np.full((len(toward), 3), 0.3) + 0.02 * np.sin(x / 9.0)[:, None]
        half = np.array(self.probe.sheet_mm) / 2
        on = (np.abs(x) < half[0]) & (np.abs(y) < half[1]) & sheet
        column = ((x[on] + half[0]) * self.probe.pixels_per_mm).astype(int)
        row = ((half[1] - y[on]) * self.probe.pixels_per_mm).astype(int)
        rows, columns = self.frame.shape
        colors[on] = 0.6 * self.frame[row.clip(0, rows - 1), column.clip(0, columns - 1), None]
        return colors


def look(tilt_deg: float, azimuth_deg: float, distance_mm: float = 330.0) -> Pose:
    """Looks at the middle between sheet and ball."""
    tilt, azimuth = np.radians([tilt_deg, azimuth_deg])
    up = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    rotation = np.stack([right, np.cross(-up, right), -up])
    return Pose(rotation, np.array([0.0, 0.0, distance_mm]) - rotation @ np.array([32.0, -4.0, 0.0]))


def bracket(radiance: np.ndarray, times=TIMES, seed: int = 0) -> list[Photograph]:
    generator = np.random.default_rng(seed)
    pictures = []
    for time in times:
        linear = radiance * time + 0.001 * generator.normal(size=radiance.shape)
        codes = np.rint(encoded_from_linear(linear) * 255).astype(np.uint8)
        pictures.append(Photograph(f"{time:g} s", codes, time))
    return pictures


@pytest.fixture(scope="module")
def scene() -> Scene:
    probe = design_probe(1)
    rasters = render_rasters(probe)
    return Scene(probe, np.where(rasters.window, 0.3, rasters.frame).astype(np.float32))


@pytest.fixture(scope="module")
def order_three() -> Probe:
    """Only its glass and frequencies are used."""
    return design_probe(3)


@pytest.fixture(scope="module")
def front() -> Pose:
    return look(42.0, -80.0)


@pytest.fixture(scope="module")
def radiance(scene, front) -> np.ndarray:
    return scene.radiance(front)


@pytest.fixture(scope="module")
def captured(scene, radiance):
    return capture_ball(bracket(radiance), scene.probe, CAMERA, 1.0)


def relative_error(found: Environment, probe: Probe) -> float:
    true = true_coefficients(probe)
    error = np.abs(found.coefficients(probe.slab, probe.frequencies) - true)
    return float(np.sqrt(np.mean(error**2)) / np.sqrt(np.mean(np.abs(true[0]) ** 2)))


def test_sheet_and_ball_are_found(captured, front):
    pose, outline = captured.picture.camera_from_probe, captured.found.outline
    seen = front.transform(BALL)
    distance = np.linalg.norm(seen)
    np.testing.assert_allclose(pose.camera_centre_mm, front.camera_centre_mm, atol=1.0)
    # a third of a pixel
    np.testing.assert_allclose(outline.axis, seen / distance, atol=0.35 / 820)
    assert outline.half_angle_rad == pytest.approx(np.arcsin(RADIUS / distance), abs=0.35 / 820)
    assert outline.resting_radius_mm(pose, -2.44) == pytest.approx(RADIUS, rel=0.01)


def test_the_light_comes_back(captured, order_three):
    light = captured.picture.light(128, REFLECTANCE)
    assert relative_error(light.environment, order_three) < 0.01
    level, true = light.environment.coefficients(order_three.slab, [[0, 0]])[0], true_coefficients(order_three)[0]
    np.testing.assert_allclose(level.real, true.real, rtol=0.015)
    assert light.clipped_share == 0.0


def test_lamps_stand_where_they_are(captured):
    light = captured.picture.light(128, REFLECTANCE)
    seen = light.environment.radiance_at(LAMPS)
    np.testing.assert_allclose(seen, sky(LAMPS), rtol=0.06)


def test_reflectance_divides(captured):
    plain, silvered = captured.picture.light(32), captured.picture.light(32, 0.5)
    np.testing.assert_allclose(silvered.radiance, 2.0 * plain.radiance, rtol=1e-5)


def test_what_the_ball_hides_lies_behind_it(captured, front):
    light = captured.picture.light(64)
    directions = MapGrid(64).directions()
    behind = front.rotation.T @ captured.found.outline.axis
    away = np.degrees(np.arccos(directions[light.weight == 0.0] @ behind))
    assert away.size > 0
    # the rim that is not believed reflects 20 to 30 degrees around it
    assert away.max() < 40.0
    # the camera looks down by 48 degrees
    assert light.coverage == 1.0
    assert light.unseen_irradiance_share() == 0.0


def test_a_low_camera_leaves_a_gap_that_a_second_view_closes(scene, order_three):
    lights = []
    for azimuth in (-70.0, -150.0):
        pose = look(78.0, azimuth)
        pictures = bracket(scene.radiance(pose, across=2))
        seen = pose.transform(BALL)
        center = CAMERA.project(pose, BALL[None])[0]
        radius = 820 * RADIUS / np.linalg.norm(seen)
        ball = capture_ball(pictures, scene.probe, CAMERA, 1.0, circle=(center[0], center[1], radius))
        lights.append(ball.picture.light(64, REFLECTANCE))
    assert all(0.9 < light.coverage < 0.995 for light in lights)
    both = merge_views(lights)
    assert both.coverage > max(light.coverage for light in lights) + 0.004
    assert both.coverage == pytest.approx(1.0, abs=1e-3)
    assert relative_error(both.environment, order_three) < 0.02


def test_merging_one_view_changes_nothing(captured):
    light = captured.picture.light(32)
    np.testing.assert_allclose(merge_views([light]).radiance, light.radiance, rtol=1e-6)


def test_a_circle_that_is_given_is_refined(scene, radiance, captured):
    center, radius = captured.found.outline.circle_px(CAMERA)
    rough = (float(center[0]) + 3.0, float(center[1]) - 2.0, radius * 1.03)
    found = capture_ball(bracket(radiance), scene.probe, CAMERA, 1.0, circle=rough).found
    np.testing.assert_allclose(found.outline.axis, captured.found.outline.axis, atol=2e-4)


def test_a_picture_without_a_ball_is_refused(scene, front):
    with pytest.raises(BallError, match="no ball was found"):
        capture_ball(bracket(scene.radiance(front, ball=False, across=2)), scene.probe, CAMERA, 1.0)


@pytest.mark.parametrize("circle", [(10.0, 270.0, 60.0), (352.0, 530.0, 60.0), (900.0, 270.0, 60.0)])
def test_a_circle_outside_the_picture_is_refused(scene, radiance, circle):
    with pytest.raises(BallError, match="leaves the picture"):
        capture_ball(bracket(radiance), scene.probe, CAMERA, 1.0, circle=circle)


def test_a_circle_of_nothing_is_refused(scene, radiance):
    with pytest.raises(BallError, match="radius must be at least"):
        capture_ball(bracket(radiance), scene.probe, CAMERA, 1.0, circle=(300.0, 300.0, 2.0))


def test_a_picture_without_the_sheet_is_refused(scene, front):
    with pytest.raises(ProbeError, match=r"the sheet .* was not found"):
        capture_ball(bracket(scene.radiance(front, sheet=False, across=2)), scene.probe, CAMERA, 1.0)


def test_lamps_that_always_clip_are_refused_with_what_is_needed(scene, radiance):
    pictures = bracket(radiance, (1.0, 1 / 2))
    with pytest.raises(PhotographError, match=r"of the ball is clipped white even at the shortest exposure \(0\.5 s\)"):
        capture_ball(pictures, scene.probe, CAMERA, 1.0)
    taken = capture_ball(pictures, scene.probe, CAMERA, 1.0, CaptureSettings(allow_clipped=True))
    light = taken.picture.light(64, REFLECTANCE)
    assert light.clipped_share > 0.001
    true = true_coefficients(scene.probe)[0].real
    assert np.all(light.environment.coefficients(scene.probe.slab, [[0, 0]])[0].real < true)


def test_brackets_all_white_are_refused(scene, radiance):
    with pytest.raises(PhotographError, match="clipped white"):
        capture_ball(bracket(radiance, (400.0, 100.0)), scene.probe, CAMERA, 1.0)


def test_brackets_all_black_are_refused(scene, radiance):
    with pytest.raises(PhotographError, match="black"):
        capture_ball(bracket(radiance, (1 / 4000, 1 / 16000)), scene.probe, CAMERA, 1.0)


def test_a_ball_left_black_is_refused_with_the_time_it_needs(scene, radiance):
    pictures = bracket(radiance, (1 / 90, 1 / 360))
    with pytest.raises(PhotographError, match=r"of the ball is black .* add one of about ([0-9.]+) s"):
        capture_ball(pictures, scene.probe, CAMERA, 1.0)


def test_a_camera_of_another_size_is_refused(scene, radiance):
    small = [Photograph(p.name, p.encoded[::2, ::2], p.exposure_s) for p in bracket(radiance)]
    with pytest.raises(PhotographError, match="is 360x270, the camera's image_size is 720x540"):
        capture_ball(small, scene.probe, CAMERA, 1.0)


def test_a_camera_that_moved_is_refused(scene, radiance):
    pictures = bracket(radiance, (1.0, 1 / 2, 1 / 16))
    moved = Photograph("moved", np.roll(pictures[1].encoded, 4, axis=1), pictures[1].exposure_s)
    with pytest.raises(PhotographError, match="pixels from where it is"):
        capture_ball([pictures[0], moved, pictures[2]], scene.probe, CAMERA, 1.0)


def test_an_impossible_reflectance_is_refused(captured):
    for reflectance in (0.0, 1.5, [0.5, 0.5, -0.1], np.nan):
        with pytest.raises(BallError, match="reflectance"):
            captured.picture.light(32, reflectance)


@pytest.mark.parametrize("rows", [0, 7, 33])
def test_an_impossible_map_is_refused(captured, rows):
    with pytest.raises(BallError, match="rows"):
        captured.picture.light(rows)
