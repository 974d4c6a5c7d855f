"""Keyed lights, their exact truth, and exposure."""

import numpy as np
import pytest

from arlight.environment import Environment
from arlight.errors import ArlightError
from arlight.fourier import half_plane_frequencies
from arlight.optics import Slab
from arlight.synthetic.light_script import LightScript, TrueLight, exposure_for

SLAB, FREQUENCIES = Slab(), half_plane_frequencies(3)


def light(seed, lamp=0.0):
    radiance = np.random.default_rng(seed).uniform(0.1, 1.0, (16, 32, 3)).astype(np.float32)
    radiance[4, 9] += lamp
    return Environment(radiance, yaw_rad=0.2 * seed)


def truth(script, time_s):
    return TrueLight(script, SLAB, FREQUENCIES).coefficients(time_s)


def test_still_light_does_not_change():
    script = LightScript(light(1))
    np.testing.assert_array_equal(truth(script, 0.0), truth(script, 4.0))
    np.testing.assert_allclose(truth(script, 1.0), light(1).coefficients(SLAB, FREQUENCIES))


@pytest.mark.parametrize("rate", [10.0, -25.0])
def test_turning_light_is_exact_at_its_keys_and_close_between(rate):
    script = LightScript(light(2, lamp=30.0), "turn", turn_deg_per_s=rate, key_deg=2.0)
    for time_s in (0.0, 6.0 / abs(rate), 33.0 / abs(rate)):
        exact = light(2, lamp=30.0).rotated(np.deg2rad(rate * time_s)).coefficients(SLAB, FREQUENCIES)
        # between keys 2 degrees apart: half a key's distance, squared, at order 3
        np.testing.assert_allclose(truth(script, time_s), exact, atol=2e-3 * abs(exact[0]).max())
    np.testing.assert_allclose(
        truth(script, 4.0 / abs(rate)), script.key(2 if rate > 0 else -2).coefficients(SLAB, FREQUENCIES)
    )


def test_switch_adds_the_second_light_at_once():
    script = LightScript(light(3), "switch", second=light(4), change_s=1.0)
    before, after = truth(script, 0.999), truth(script, 1.0)
    np.testing.assert_array_equal(before, truth(script, 0.0))
    added = light(4).coefficients(SLAB, FREQUENCIES)
    # the second map, turned otherwise, is resampled to the first's grid
    np.testing.assert_allclose(after - before, added, atol=0.02 * abs(added[0]).max())


def test_fade_is_linear_in_time():
    script = LightScript(light(5), "fade", second=light(6), change_s=1.0, fade_s=2.0)
    start, middle, end = truth(script, 1.0), truth(script, 2.0), truth(script, 3.0)
    np.testing.assert_allclose(middle, (start + end) / 2)
    np.testing.assert_array_equal(truth(script, 0.2), start)
    np.testing.assert_array_equal(truth(script, 9.0), end)


@pytest.mark.parametrize("name", ["turn", "switch", "fade", "still"])
def test_exposure_scales_every_key(name):
    script = LightScript(light(7), name, second=light(8))
    for time_s in (0.0, 2.6, 4.9):
        np.testing.assert_allclose(truth(script.scaled(2.5), time_s), 2.5 * truth(script, time_s), rtol=1e-5)


def test_exposure_puts_white_paper_where_asked():
    script = LightScript(light(9), "switch", second=light(10, lamp=40.0))
    exposed = script.scaled(exposure_for(script, 0.9, 0.6))
    brightest = exposed.key(1).irradiance().max()
    assert 0.9 * brightest / np.pi == pytest.approx(0.6, rel=1e-5)


def test_black_environment_cannot_be_exposed():
    with pytest.raises(ArlightError, match="black"):
        exposure_for(LightScript(Environment(np.zeros((8, 16, 3), np.float32))), 0.9, 0.6)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"name": "strobe"}, "strobe"),
        ({"name": "switch"}, "second environment"),
        ({"name": "fade", "fade_s": 0.0, "second": light(1)}, "positive"),
        ({"name": "turn", "turn_deg_per_s": np.nan}, "finite"),
    ],
)
def test_impossible_scripts_are_refused(wrong, message):
    with pytest.raises(ArlightError, match=message):
        LightScript(light(1), **wrong)
