"""Merging brackets: radiance comes back over a range that no single picture holds; impossible brackets are refused."""

import numpy as np
import pytest

from arlight.calibration.ball.exposure_merge import merge_exposures
from arlight.calibration.ball.photographs import Photograph, PhotographError
from arlight.color import encoded_from_linear


def scene(low: float = 0.01, high: float = 50.0) -> np.ndarray:
    ramp = np.geomspace(low, high, 120 * 160).reshape(120, 160, 1)
    return (ramp * np.array([1.0, 0.9, 0.8])).astype(np.float32)


def shot(radiance: np.ndarray, exposure_s: float, stated_s: float | None = None, transfer="srgb") -> Photograph:
    codes = np.rint(encoded_from_linear(radiance * exposure_s, transfer) * 255).astype(np.uint8)
    return Photograph(f"{exposure_s:g}.png", codes, exposure_s if stated_s is None else stated_s)


@pytest.mark.parametrize("transfer", ["srgb", "gamma22", "linear"])
def test_radiance_comes_back(transfer):
    radiance = scene()
    pictures = [shot(radiance, t, transfer=transfer) for t in (4.0, 1.0, 1 / 4, 1 / 16, 1 / 64)]
    merged = merge_exposures(pictures, 1.0, transfer)
    # half a code is 2 % at code 25, and several pictures share the work; linear codes are coarser in the dark
    visible = radiance > (0.05 if transfer == "linear" else 0.02)
    error = np.abs(merged.radiance / radiance - 1.0)[visible]
    assert np.median(error) < 0.005
    assert error.max() < 0.04
    assert not merged.clipped.any()


def test_the_reference_exposure_sets_the_scale():
    pictures = [shot(scene(0.05, 5.0), t) for t in (1.0, 0.1)]
    first, second = merge_exposures(pictures, 1.0), merge_exposures(pictures, 0.25)
    np.testing.assert_allclose(second.radiance, 0.25 * first.radiance, rtol=1e-4)


def test_what_clips_everywhere_is_a_marked_lower_bound():
    radiance = scene()
    merged = merge_exposures([shot(radiance, t) for t in (1.0, 1 / 8)], 1.0)
    bright = np.any(radiance / 8 > 1.0, axis=-1)
    assert merged.clipped[bright].all()
    assert not merged.clipped[np.all(radiance / 8 < 0.99, axis=-1)].any()
    assert np.all(merged.radiance[bright] <= radiance[bright] * 1.02)
    np.testing.assert_allclose(merged.radiance[-1, -1], 8.0, rtol=1e-4)


def test_what_no_picture_shows_is_marked_black():
    merged = merge_exposures([shot(scene(1e-6, 0.5), t) for t in (1.0, 1 / 8)], 1.0)
    assert merged.black[0, 0]
    assert not merged.black[-1, -1]
    assert np.all(np.isfinite(merged.radiance))


def test_a_single_picture_is_its_own_radiance():
    radiance = scene(0.01, 0.9)
    merged = merge_exposures([shot(radiance, 1.0)], 1.0)
    np.testing.assert_allclose(merged.radiance, radiance, rtol=0.04)


def test_order_does_not_matter():
    pictures = [shot(scene(), t) for t in (4.0, 1.0, 1 / 4)]
    first, second = merge_exposures(pictures, 1.0), merge_exposures(pictures[::-1], 1.0)
    np.testing.assert_array_equal(first.radiance, second.radiance)


def test_pictures_of_different_size_are_refused():
    small = Photograph("small.png", np.zeros((60, 80, 3), np.uint8), 0.5)
    with pytest.raises(PhotographError, match=r"small\.png: is 80x60, 1\.png is 160x120"):
        merge_exposures([shot(scene(), 1.0), small], 1.0)


def test_exposures_all_alike_are_refused():
    with pytest.raises(PhotographError, match="same exposure"):
        merge_exposures([shot(scene(), 1.0), shot(scene(), 1.0, stated_s=1.1)], 1.0)


@pytest.mark.parametrize("time", [0.0, -1.0, np.nan, np.inf])
def test_impossible_exposures_are_refused(time):
    with pytest.raises(PhotographError, match="positive time"):
        merge_exposures([shot(scene(), 1.0, stated_s=time)], 1.0)


def test_exposures_that_the_pictures_contradict_are_refused():
    swapped = [shot(scene(), 1.0, stated_s=0.25), shot(scene(), 0.25, stated_s=1.0)]
    with pytest.raises(PhotographError, match="times as bright"):
        merge_exposures(swapped, 1.0)


def test_no_picture_is_refused():
    with pytest.raises(PhotographError, match="no photograph"):
        merge_exposures([], 1.0)
