"""The response measured from a wedge whose codes were made by known curves."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.camera.camera_response import measure_response
from arlight.calibration.camera.paper_samples import PaperSamples
from arlight.calibration.camera.response_curve import fit_response, patches_of
from arlight.calibration.camera.sensor_noise import clipping_level, fit_noise
from arlight.color import encoded_from_linear
from arlight.errors import CalibrationError
from arlight.radiometry import Radiometry
from arlight.video.frame import Frame

CURVES = {
    "sRGB": encoded_from_linear,
    "BT.709": lambda light: encoded_from_linear(light, "bt709"),
    "gamma 2": np.sqrt,
    "with a shoulder": lambda light: encoded_from_linear(light * (1.25 - 0.25 * light)),
}


def wedge_pictures(curve, exposures=(0.9, 0.6), black=0.0, read=0.002, shot=1e-4, steps=12, seed=3):
    """Two rows of grey steps and paper between them under light that falls off, as one would read them."""
    rng = np.random.default_rng(seed)
    values = np.repeat(np.append(np.geomspace(1.0, 0.03, steps), 1.0), 60)
    patch = np.repeat(np.append(np.arange(steps), -1), 60)
    places = rng.uniform(-45, 45, (len(values) // 60, 2)).repeat(60, axis=0) + rng.uniform(-3, 3, (len(values), 2))
    extra = rng.uniform(-45, 45, (900, 2))
    points, ink = np.concatenate([places, extra]), np.append(values, np.ones(900))
    patch = np.append(patch, np.full(900, -1))
    sector = np.floor((np.arctan2(points[:, 1], points[:, 0]) / (2 * np.pi) + 0.5) * 24).astype(int) % 24
    found = []
    for exposure in exposures:
        falling = exposure * (1 + 0.003 * points[:, 0] - 0.002 * points[:, 1] + 2e-5 * points[:, 0] ** 2)
        light = ink[:, None] * falling[:, None] * [1.0, 0.85, 0.7]
        signal = black + (1 - black) * light
        signal = signal + rng.normal(size=signal.shape) * np.sqrt(read**2 + shot * signal)
        encoded = np.rint(np.asarray(curve(np.clip(signal, 0, 1)), float) * 255) / 255
        found.append(PaperSamples(points, np.zeros((len(points), 2), np.int64), encoded, ink, patch, sector))
    return found


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES.keys())
def test_light_is_proportional_after_decoding(curve):
    fit = fit_response(patches_of(wedge_pictures(curve)), "srgb", 50.0)
    light = np.linspace(0.04, 0.85, 30)
    shares = Radiometry(fit.response, fit.black).linear(curve(light)) / light
    # relative to each other: what is called full scale lies beyond the brightest step
    error = np.abs(shares / np.median(shares) - 1.0)
    # half of one code of eight bits, which is much in the dark
    code = np.gradient(light, np.asarray(curve(light), float)) / 255.0 / light
    assert np.all(error < 0.003 + 0.5 * code)


def test_the_footages_own_curve_is_left_alone():
    fit = fit_response(patches_of(wedge_pictures(encoded_from_linear)), "srgb", 50.0)
    assert fit.deviation < 0.01
    assert fit.residual < 0.002


@pytest.mark.parametrize("black", [0.0, 0.015])
def test_black_is_told_from_the_curve(black):
    fit = fit_response(patches_of(wedge_pictures(encoded_from_linear, black=black)), "srgb", 50.0)
    assert abs(fit.black - black) < max(4.0 * fit.black_stddev, 0.001) < 0.005


def test_noise_is_the_sensors():
    pictures = wedge_pictures(encoded_from_linear, read=0.003, shot=3e-4)
    fit = fit_response(patches_of(pictures), "srgb", 50.0)
    read, shot = fit_noise(pictures, Radiometry(fit.response, fit.black))
    # a hundred patches of 60 pixels: 2 % of the variance, and its share of the dark is the larger one's difference
    assert shot == pytest.approx(3e-4, rel=0.15)
    assert read == pytest.approx(0.003, rel=0.2)


def test_clipping_is_found_where_codes_pile_up():
    rng = np.random.default_rng(0)
    straight = Radiometry(tuple(np.linspace(0, 1, 9)))
    shown = rng.uniform(0, 1.3, (120, 160, 3)).mean(axis=2, keepdims=True).repeat(3, axis=2)
    clipped = Frame.from_rgb(np.rint(np.minimum(shown * 1.3, 0.9) * 255).astype(np.uint8))
    open_ = Frame.from_rgb(np.rint(rng.uniform(0, 0.9, (120, 160, 1)).repeat(3, axis=2) * 255).astype(np.uint8))
    assert clipping_level([clipped], straight) == pytest.approx(0.97 * 0.9, abs=0.005)
    assert clipping_level([open_], straight) == 0.94


def test_a_wedge_out_of_sight_is_refused():
    pictures = wedge_pictures(encoded_from_linear, steps=4)
    with pytest.raises(CalibrationError, match=r"at least 5 steps.*found 3"):
        fit_response(patches_of(pictures), "srgb", 50.0)
    with pytest.raises(CalibrationError, match="found 0"):
        fit_response([], "srgb", 50.0)


def test_dark_pictures_are_refused():
    with pytest.raises(CalibrationError, match="brighter light"):
        fit_response(patches_of(wedge_pictures(encoded_from_linear, exposures=(0.15,))), "srgb", 50.0)


def test_steps_in_another_order_are_refused():
    pictures = wedge_pictures(encoded_from_linear)
    for picture in pictures:
        picture.encoded[:] = 1.0 - picture.encoded
    with pytest.raises(CalibrationError, match=r"no rising curve|brighter light|at least 5"):
        fit_response(patches_of(pictures), "srgb", 50.0)


@pytest.fixture(scope="module")
def photographs(sheet_print, lens_camera, look, photograph):
    poses = [look(30.0, -100.0, 145.0), look(40.0, -60.0, 150.0)]
    return [
        Frame.from_rgb(photograph(sheet_print, lens_camera, pose, light, np.sqrt, seed=k), k, k / 25)
        for k, (pose, light) in enumerate(zip(poses, [(1.0, 0.9, 0.8), (0.7, 0.6, 0.5)], strict=True))
    ]


def test_photographs_of_the_sheet_give_the_cameras_curve(photographs, small_sheet, lens_camera):
    measured = measure_response(photographs, small_sheet, lens_camera)
    assert measured.frames == 2
    light = np.linspace(0.05, 0.8, 20)
    shares = measured.radiometry.linear(np.sqrt(light)) / light
    np.testing.assert_allclose(shares / np.median(shares), 1.0, atol=0.015)
    assert 0.001 < measured.radiometry.read_noise < 0.004


def test_pictures_without_the_sheet_are_refused(small_sheet, lens_camera):
    wall = Frame.from_rgb(np.full((480, 640, 3), 90, np.uint8))
    with pytest.raises(CalibrationError, match="no picture shows the sheet"):
        measure_response([wall], small_sheet, lens_camera)


def test_a_sheet_without_a_wedge_is_refused(photographs, small_sheet, lens_camera):
    bare = replace(small_sheet, blocks=tuple(block for block in small_sheet.blocks if block.kind != "wedge"))
    with pytest.raises(CalibrationError, match="no grey wedge"):
        measure_response(photographs, bare, lens_camera)


def test_pictures_of_two_encodings_are_refused(photographs, small_sheet, lens_camera):
    red, green, blue = photographs[1].planes
    other = Frame.from_rgb(np.stack([red, green, blue], axis=-1), 1, 0.1, "bt709")
    with pytest.raises(CalibrationError, match="encoded alike"):
        measure_response([photographs[0], other], small_sheet, lens_camera)
