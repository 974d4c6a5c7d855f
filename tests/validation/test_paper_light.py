"""The gathered light against cases that are known without it."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.environment import Environment
from arlight.optics import Slab
from arlight.validation import paper_light
from arlight.validation.paper_light import GatherSettings, gather_irradiance, radiosity

SETTINGS = GatherSettings(9, 8, 1)


def middle(irradiance):
    rows, columns = irradiance.shape[2:]
    return irradiance[:, :, rows // 2 - 5 : rows // 2 + 5, columns // 2 - 5 : columns // 2 + 5]


@pytest.mark.usefixtures("path_tracer")
def test_furnace(open_layers):
    """Clear film, white paper, even light: the glass gives back what it keeps out, the irradiance is pi."""
    even = Environment(np.ones((8, 16, 3), np.float32))
    inside = middle(gather_irradiance(open_layers, [even], SETTINGS))
    np.testing.assert_allclose(inside, np.pi, rtol=5e-3)


@pytest.mark.usefixtures("path_tracer")
def test_black_paper_gets_what_the_slab_lets_through(open_layers):
    black = replace(open_layers, paper=np.zeros_like(open_layers.paper))
    even = Environment(np.ones((8, 16, 3), np.float32))
    cosine = (np.arange(20000) + 0.5) / 20000
    # light that the upper face sends back down adds to (1 - R)^2: the incoherent slab
    expected = np.pi * np.mean(2 * cosine * Slab().transmittance(cosine))
    np.testing.assert_allclose(middle(gather_irradiance(black, [even], SETTINGS)), expected, rtol=3e-3)


@pytest.mark.usefixtures("path_tracer")
def test_light_adds_up(small_layers, smooth_light):
    other = Environment(np.ascontiguousarray(smooth_light.radiance[:, ::-1, ::-1]))
    both = Environment(smooth_light.radiance + 2 * other.radiance)
    few = GatherSettings(5, 4, 2)
    one, two, total = gather_irradiance(small_layers, [smooth_light, other, both], few)
    np.testing.assert_allclose(one + 2 * two, total, rtol=1e-4, atol=1e-5)


@pytest.mark.usefixtures("path_tracer")
def test_chunks_make_no_difference(small_layers, smooth_light, monkeypatch):
    few = GatherSettings(5, 4, 2)
    whole = gather_irradiance(small_layers, [smooth_light], few)
    monkeypatch.setattr(paper_light, "_CHUNK", 7)
    np.testing.assert_allclose(gather_irradiance(small_layers, [smooth_light], few), whole, rtol=1e-5, atol=1e-6)


def test_radiosity_is_reflectance_times_irradiance_between_the_samples_too(open_layers):
    rows, columns = open_layers.film.shape[0] // 4, open_layers.film.shape[1] // 4

    def wave(y, x):
        return 2 + np.sin(2 * np.pi * x / 8.5) * np.cos(2 * np.pi * y / 11.0)

    coarse = wave(*np.mgrid[:rows, :columns]).astype(np.float32)
    fine = radiosity(open_layers, coarse[None])[..., 0]
    expected = wave(*(np.mgrid[: 2 * rows, : 2 * columns] / 2.0))
    inside = (slice(12, -12), slice(12, -12))
    assert np.abs(fine - expected)[inside].max() < 2e-3


@pytest.mark.usefixtures("path_tracer")
def test_the_gathered_light_leaves_the_frames_shade_dark(small_layers, smooth_light):
    irradiance = gather_irradiance(small_layers, [smooth_light], GatherSettings(5, 4, 1))
    assert irradiance[:, :, 0, 0] == pytest.approx(0.0, abs=1e-6)
    assert irradiance.max() < 4 * np.pi * smooth_light.radiance.max()
