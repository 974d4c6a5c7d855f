"""Statistics of the sensor: blur, noise, falloff, encoding."""

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.color import linear_from_encoded
from arlight.errors import ArlightError
from arlight.synthetic.sensor import Sensor

CAMERA = Camera((160, 120), [[150.0, 0, 80.0], [0, 150.0, 60.0], [0, 0, 1]], np.zeros(5))
CLEAN = Sensor(blur_px=0.0, vignetting=0.0, read_noise=0.0, gain=0.0)


def expose(sensor, radiance, seed=0):
    return sensor.expose(np.asarray(radiance, np.float32), CAMERA, np.random.default_rng(seed))


def flat(value):
    return np.full((120, 160, 3), value, np.float32)


def test_clean_sensor_rounds_to_the_nearest_code():
    radiance = np.random.default_rng(1).uniform(0, 1, (120, 160, 3))
    codes = expose(CLEAN, radiance)
    assert codes.dtype == np.uint8
    low, high = (linear_from_encoded((codes + half) / 255.0) for half in (-0.5, 0.5))
    assert np.all((low <= radiance + 1e-6) & (radiance <= high + 1e-6))


def test_over_full_scale_is_clipped_after_the_blur():
    radiance = flat(0.0)
    radiance[60, 80] = 50.0
    codes = expose(Sensor(1.5, 0.0, 0.0, 0.0), radiance)
    # 50 spread over a Gaussian of 1.5 px: the lamp's neighbours saturate too
    assert codes[60, 80].min() == 255
    assert codes[60, 82].min() == 255
    assert codes[60, 90].max() == 0


@pytest.mark.parametrize("level", [0.02, 0.2, 0.7])
def test_noise_has_the_stated_variance(level):
    sensor = Sensor(blur_px=0.0, read_noise=0.01, gain=4e-4)
    linear = linear_from_encoded(expose(sensor, flat(level)) / 255.0)
    step = linear_from_encoded((expose(CLEAN, flat(level)) + 1.0) / 255.0).mean() - level
    expected = 0.01**2 + 4e-4 * level + step**2 / 12
    # 57600 samples: the variance is known to 0.6 %; clipping at black takes a little at the lowest level
    assert linear.var() == pytest.approx(expected, rel=0.04 if level > 0.1 else 0.1)
    assert linear.mean() == pytest.approx(level, abs=1e-3)


def test_blur_keeps_energy_and_has_the_stated_width():
    sensor = Sensor(blur_px=1.7, vignetting=0.0, read_noise=0.0, gain=0.0)
    edge = flat(0.1)
    edge[:, 80:] = 0.9
    linear = linear_from_encoded(expose(sensor, edge) / 255.0)[60, :, 1]
    slope = np.diff(linear)
    position = np.arange(159) + 0.5
    centre = np.sum(slope * position) / slope.sum()
    width = np.sqrt(np.sum(slope * (position - centre) ** 2) / slope.sum())
    assert centre == pytest.approx(79.5, abs=0.05)
    assert width == pytest.approx(1.7, abs=0.1)
    assert linear.mean() == pytest.approx(0.5, abs=2e-3)


def test_natural_vignetting_is_the_fourth_power_of_the_cosine():
    linear = linear_from_encoded(expose(Sensor(0.0, 1.0, 0.0, 0.0), flat(0.8)) / 255.0)
    ray = CAMERA.rays([[10.0, 20.0]])[0]
    cosine = 1 / np.linalg.norm(np.append(ray, 1.0))
    assert linear[20, 10, 0] == pytest.approx(0.8 * cosine**4, abs=4e-3)
    assert linear[60, 80, 0] == pytest.approx(0.8, abs=4e-3)


def test_same_seed_same_picture():
    np.testing.assert_array_equal(expose(Sensor(), flat(0.4), 5), expose(Sensor(), flat(0.4), 5))
    assert np.any(expose(Sensor(), flat(0.4), 5) != expose(Sensor(), flat(0.4), 6))


@pytest.mark.parametrize("wrong", [{"blur_px": -1.0}, {"gain": np.nan}, {"read_noise": np.inf}])
def test_impossible_sensor_is_refused(wrong):
    with pytest.raises(ArlightError, match=next(iter(wrong))):
        Sensor(**wrong)
