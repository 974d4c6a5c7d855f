"""A sheet's layers in absolute units, and reading them without losing contrast."""

import numpy as np
import pytest

from arlight.errors import ProbeError
from arlight.probe.layout import design_probe
from arlight.probe.rasters import Rasters, render_rasters
from arlight.synthetic.sheet import SheetLayers, sharpen_for_bilinear

PROBE = design_probe(order=1, pixels_per_mm=8.0, paper_reflectance=0.8, film_transmittance=0.9)


def test_layers_are_absolute_and_the_frame_is_opaque():
    layers, rasters = SheetLayers.of_probe(PROBE), render_rasters(PROBE)
    inside = layers.opening > 0.5
    assert layers.film[inside].max() == pytest.approx(0.9)
    assert layers.film[~inside].max() == 0.0
    assert layers.paper.max() == pytest.approx(0.8)
    np.testing.assert_allclose(layers.frame[~inside], 0.8 * rasters.frame[~inside], rtol=1e-6)
    assert layers.frame[inside].max() == 0.0
    np.testing.assert_allclose(layers.size_mm, PROBE.sheet_mm, atol=0.5 / 8.0)


def test_layers_of_different_size_are_refused():
    rasters = render_rasters(PROBE)
    with pytest.raises(ProbeError, match="one pixel grid"):
        SheetLayers.from_rasters(PROBE, Rasters(rasters.film[1:], rasters.paper, rasters.frame, rasters.window))


# period in samples: order 5 on a raster, order 5 and order 8 on the irradiance's grid
@pytest.mark.parametrize(("period", "tolerance"), [(17.0, 2e-4), (8.5, 1e-3), (5.3, 6e-3)])
def test_sharpened_samples_read_bilinearly_keep_the_amplitude(period, tolerance):
    x = np.arange(400)
    image = np.tile(0.5 + 0.5 * np.cos(2 * np.pi * x / period), (8, 1)).astype(np.float32)
    sharpened = sharpen_for_bilinear(image)[4]
    at = np.random.default_rng(0).uniform(20, 380, 40_000)
    read = np.interp(at, x, sharpened)
    amplitude = 2 * np.mean((read - read.mean()) * np.exp(2j * np.pi * at / period))
    plain = 2 * np.mean(np.interp(at, x, image[4]) * np.exp(2j * np.pi * at / period))
    assert abs(amplitude) == pytest.approx(0.5, abs=tolerance + 0.005)
    assert 0.5 - abs(amplitude) < 0.5 - abs(plain)


def test_sharpening_keeps_the_mean_and_constant_images():
    image = np.random.default_rng(1).uniform(0, 1, (50, 60)).astype(np.float32)
    assert sharpen_for_bilinear(image).mean() == pytest.approx(image.mean(), abs=2e-3)
    np.testing.assert_allclose(sharpen_for_bilinear(np.full((9, 9), 0.3, np.float32)), 0.3, atol=1e-6)
