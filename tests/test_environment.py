"""Captured environments: their frame, integrals and coefficients, and what their files may hold."""

import cv2
import numpy as np
import OpenEXR
import pytest
from scipy.integrate import quad
from scipy.special import j0

from arlight.environment import Environment, blend
from arlight.errors import EnvironmentMapError
from arlight.fourier import half_plane_frequencies
from arlight.optics import Slab

SLAB = Slab()
FREQUENCIES = half_plane_frequencies(5)


def row_of(frequency):
    return FREQUENCIES.tolist().index(list(frequency))


def random_environment(seed, rows=16, yaw=0.0):
    return Environment(np.random.default_rng(seed).uniform(0, 5, (rows, 2 * rows, 3)).astype(np.float32), yaw)


def uniform_sky(rows, radiance=1.0):
    return Environment(np.full((rows, 2 * rows, 3), radiance, np.float32))


def direction_of(polar, azimuth):
    return np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def transmittance(polar):
    """Both faces of 1.52 glass by Fresnel's sines and tangents, light thrown to and fro included."""
    if polar < 1e-6:
        face = (0.52 / 2.52) ** 2
    else:
        inside = np.arcsin(np.sin(polar) / 1.52)
        across = np.sin(polar - inside) / np.sin(polar + inside)
        along = np.tan(polar - inside) / np.tan(polar + inside)
        face = 0.5 * (across**2 + along**2)
    return (1 - face) / (1 + face)


def light_plane_radius(polar):
    return np.tan(np.arcsin(np.sin(polar) / 1.52)) * np.sqrt(1.52**2 - 1) / 2


def test_irradiance_of_a_uniform_sky_is_pi():
    # midpoint rule in the polar angle: pi^2 / (24 * (rows/2)^2) of it
    assert uniform_sky(256, 2.0).irradiance() == pytest.approx(2 * np.pi, rel=1e-4)


def test_a_sky_as_bright_as_the_cosine_gives_two_thirds_of_pi():
    sky = uniform_sky(256)
    cosine = np.cos((np.arange(256) + 0.5) * np.pi / 256)
    lit = Environment((sky.radiance * np.maximum(cosine, 0)[:, None, None]).astype(np.float32))
    assert lit.irradiance() == pytest.approx(2 / 3 * np.pi, rel=1e-4)


def test_solid_angles_of_the_samples_add_up_to_the_hemisphere():
    directions, light = uniform_sky(128).samples()
    assert light.sum(axis=0) == pytest.approx(2 * np.pi, rel=1e-4)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-12)
    assert directions[:, 2].min() > 0


def test_a_ground_below_the_horizon_sends_nothing():
    dark = random_environment(0)
    bright = dark.radiance.copy()
    bright[8:] = 1000
    np.testing.assert_array_equal(Environment(bright).irradiance(), dark.irradiance())


def test_a_uniform_skys_coefficients_are_hankel_integrals_of_the_transmittance():
    coefficients = uniform_sky(256).coefficients(SLAB, FREQUENCIES)
    for frequency in ((0, 0), (1, 0), (-2, 1), (3, 4)):
        n = np.hypot(*frequency)
        expected, _ = quad(
            lambda polar, n=n: (
                2
                * np.pi
                * np.sin(polar)
                * np.cos(polar)
                * transmittance(polar)
                * j0(2 * np.pi * n * light_plane_radius(polar))
            ),
            0,
            np.pi / 2,
        )
        np.testing.assert_allclose(coefficients[row_of(frequency)], np.full(3, expected), atol=2e-4)


def test_row_0_is_the_zenith_and_azimuth_runs_from_x_toward_y():
    radiance = np.zeros((64, 128, 3), np.float32)
    radiance[10, 40] = [1, 2, 3]
    polar, azimuth = 10.5 / 64 * np.pi, 40.5 / 128 * 2 * np.pi
    environment = Environment(radiance)
    w = direction_of(polar, azimuth)
    np.testing.assert_allclose(environment.radiance_at(w), [1, 2, 3], rtol=1e-6)
    # one lamp: its place on the light plane is in the phases of (1, 0) and (0, 1)
    coefficients = environment.coefficients(SLAB, FREQUENCIES)
    solid_angle = np.sin(polar) * (np.pi / 64) * (2 * np.pi / 128)
    strength = solid_angle * np.cos(polar) * transmittance(polar)
    np.testing.assert_allclose(coefficients[0], strength * np.array([1, 2, 3]), rtol=1e-6)
    place = light_plane_radius(polar) * np.array([np.cos(azimuth), np.sin(azimuth)])
    for frequency, expected in (((1, 0), place[0]), ((0, 1), place[1])):
        phase = np.angle(coefficients[row_of(frequency)])
        np.testing.assert_allclose(phase, np.full(3, -2 * np.pi * expected), rtol=1e-6)


def test_a_quarter_turn_permutes_the_coefficients():
    environment = random_environment(1)
    table = dict(zip(map(tuple, FREQUENCIES.tolist()), environment.coefficients(SLAB, FREQUENCIES), strict=True))
    turned = environment.rotated(np.pi / 2).coefficients(SLAB, FREQUENCIES)
    for (u, v), found in zip(FREQUENCIES.tolist(), turned, strict=True):
        expected = table[v, -u] if (v, -u) in table else np.conj(table[-v, u])
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_turning_is_rolling_the_map():
    environment = random_environment(2)
    rolled = Environment(np.roll(environment.radiance, 5, axis=1))
    turned = environment.rotated(5 / 32 * 2 * np.pi)
    np.testing.assert_allclose(
        turned.coefficients(SLAB, FREQUENCIES), rolled.coefficients(SLAB, FREQUENCIES), atol=1e-12
    )
    w = np.stack([direction_of(*angles) for angles in np.random.default_rng(3).uniform([0, 0], [3.1, 6.3], (50, 2))])
    np.testing.assert_allclose(turned.radiance_at(w), rolled.radiance_at(w), rtol=1e-5)


def test_turns_add_up_and_leave_the_radiance_alone():
    environment = random_environment(4)
    assert environment.rotated(0.3).rotated(0.4).yaw_rad == pytest.approx(0.7)
    assert environment.rotated(0.3).radiance is environment.radiance
    np.testing.assert_allclose(
        environment.rotated(2 * np.pi).coefficients(SLAB, FREQUENCIES),
        environment.coefficients(SLAB, FREQUENCIES),
        atol=1e-11,
    )


def test_exposure_scales_everything():
    environment = random_environment(5, yaw=0.4)
    twice = environment.scaled(2.0)
    np.testing.assert_allclose(twice.irradiance(), 2 * environment.irradiance(), rtol=1e-6)
    assert twice.yaw_rad == 0.4


def test_radiance_between_pixels_is_bilinear_and_closed_around_the_axis():
    environment = random_environment(6, yaw=-1.3)
    r = environment.radiance.astype(float)

    def at(row, column):
        return environment.radiance_at(direction_of((row + 0.5) / 16 * np.pi, (column + 0.5) / 32 * 2 * np.pi - 1.3))

    np.testing.assert_allclose(at(3, 7), r[3, 7], rtol=1e-6)
    np.testing.assert_allclose(at(3.5, 7), (r[3, 7] + r[4, 7]) / 2, rtol=1e-6)
    np.testing.assert_allclose(at(3.25, 7.5), 0.375 * (r[3, 7] + r[3, 8]) + 0.125 * (r[4, 7] + r[4, 8]), rtol=1e-6)
    np.testing.assert_allclose(at(5, 31.5), (r[5, 31] + r[5, 0]) / 2, rtol=1e-6)
    np.testing.assert_allclose(at(5, -0.25), 0.75 * r[5, 0] + 0.25 * r[5, 31], rtol=1e-6)


def test_the_poles_have_a_radiance():
    environment = random_environment(7)
    poles = environment.radiance_at([[0, 0, 1], [0, 0, -1], [0, 0, 1 + 1e-12]])
    assert np.all(np.isfinite(poles))
    assert poles.min() >= environment.radiance.min()
    assert poles.max() <= environment.radiance.max()


def test_a_smooth_sky_is_read_to_the_second_order():
    rows = 64
    polar, azimuth = np.meshgrid(
        (np.arange(rows) + 0.5) / rows * np.pi, (np.arange(128) + 0.5) / 64 * np.pi, indexing="ij"
    )
    w = np.moveaxis(direction_of(polar, azimuth), 0, -1)
    radiance = 2 + w @ np.array([0.5, -0.3, 0.7])
    environment = Environment(np.repeat(radiance[..., None], 3, axis=2).astype(np.float32))
    generator = np.random.default_rng(8)
    seen = np.stack([direction_of(*angles) for angles in generator.uniform([0.1, 0], [3.0, 6.3], (200, 2))])
    # (pi/64)^2 / 8 in each of two directions
    np.testing.assert_allclose(environment.radiance_at(seen)[:, 0], 2 + seen @ [0.5, -0.3, 0.7], atol=7e-4)


def test_blending_is_the_mean_of_both_where_they_stand():
    first, second = random_environment(9, yaw=0.8), random_environment(10, rows=32, yaw=-0.5)
    w = np.stack(
        [direction_of((r + 0.5) / 16 * np.pi, (c + 0.5) / 16 * np.pi + 0.8) for r in range(16) for c in range(0, 32, 5)]
    )
    for share in (0.0, 0.3, 1.0):
        mixed = blend(first, second, share)
        assert mixed.radiance.shape == first.radiance.shape
        expected = (1 - share) * first.radiance_at(w) + share * second.radiance_at(w)
        np.testing.assert_allclose(mixed.radiance_at(w), expected, rtol=1e-5)
    assert blend(first, second, 0.0) is first


def test_blending_with_itself_changes_nothing():
    environment = random_environment(11, yaw=2.0)
    np.testing.assert_allclose(blend(environment, environment, 0.6).radiance, environment.radiance, rtol=1e-5)


def test_a_radiance_file_comes_back_to_its_eight_bit_mantissa(tmp_path):
    environment = random_environment(12)
    path = tmp_path / "sky.hdr"
    assert cv2.imwrite(str(path), environment.radiance[..., ::-1])
    loaded = Environment.load(path).radiance
    assert loaded.dtype == np.float32
    assert np.abs(loaded - environment.radiance).max() <= environment.radiance.max() / 128


@pytest.mark.parametrize(("number", "rtol"), [(np.float32, 0), (np.float16, 1e-3)])
@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize("suffix", [".exr", ".EXR", ""])
def test_an_openexr_file_comes_back(tmp_path, number, rtol, alpha, suffix):
    environment = random_environment(13)
    channels = {name: environment.radiance[..., i].astype(number) for i, name in enumerate("RGB")}
    if alpha:
        channels["A"] = np.ones((16, 32), number)
    path = tmp_path / f"sky{suffix}"
    OpenEXR.File({}, channels).write(str(path))
    np.testing.assert_allclose(Environment.load(path).radiance, environment.radiance, rtol=rtol)


def write_exr(path, radiance):
    OpenEXR.File({}, {"RGB": np.ascontiguousarray(radiance, np.float32)}).write(str(path))


@pytest.mark.parametrize("shape", [(16, 16), (16, 30), (32, 16), (15, 30), (2, 4)])
def test_maps_of_another_shape_are_refused(tmp_path, shape):
    path = tmp_path / "wrong.exr"
    write_exr(path, np.ones((*shape, 3)))
    with pytest.raises(EnvironmentMapError, match=rf"wrong\.exr: expected .*found {shape[1]} x {shape[0]}"):
        Environment.load(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -0.01])
def test_impossible_radiance_is_refused(tmp_path, value):
    radiance = np.ones((16, 32, 3))
    radiance[3, 4, 1] = value
    path = tmp_path / "wrong.exr"
    write_exr(path, radiance)
    with pytest.raises(EnvironmentMapError, match=r"wrong\.exr: radiance must be finite and not negative"):
        Environment.load(path)


def test_maps_without_colour_are_refused(tmp_path):
    path = tmp_path / "grey.exr"
    OpenEXR.File({}, {"Y": np.ones((16, 32), np.float32)}).write(str(path))
    with pytest.raises(EnvironmentMapError, match=r"grey\.exr: expected the channels R, G and B, found Y"):
        Environment.load(path)


def test_eight_bit_pictures_are_refused(tmp_path):
    path = tmp_path / "photo.png"
    assert cv2.imwrite(str(path), np.full((16, 32, 3), 200, np.uint8))
    with pytest.raises(EnvironmentMapError, match=r"photo\.png: not a readable \.hdr or \.exr"):
        Environment.load(path)


@pytest.mark.parametrize("suffix", [".hdr", ".exr"])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.99])
def test_files_cut_short_are_refused(tmp_path, suffix, share):
    whole = tmp_path / f"whole{suffix}"
    if suffix == ".exr":
        write_exr(whole, random_environment(14, 64).radiance)
    else:
        cv2.imwrite(str(whole), random_environment(14, 64).radiance)
    content = whole.read_bytes()
    path = tmp_path / f"cut{suffix}"
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(EnvironmentMapError, match=f"cut{suffix}"):
        Environment.load(path)


@pytest.mark.parametrize("name", ["text.hdr", "text.exr", "text"])
def test_files_that_are_no_image_are_refused(tmp_path, name):
    path = tmp_path / name
    path.write_text("not an image\n" * 50)
    with pytest.raises(EnvironmentMapError, match=rf"{name}: not a readable \.hdr or \.exr"):
        Environment.load(path)


def test_missing_files_are_refused(tmp_path):
    for path in (tmp_path / "nowhere.hdr", tmp_path):
        with pytest.raises(EnvironmentMapError, match="no such environment"):
            Environment.load(path)
