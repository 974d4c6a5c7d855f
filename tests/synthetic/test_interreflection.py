"""Light between paper and glass against Monte Carlo over rays and against the sum of the geometric series."""

import numpy as np
import pytest

from arlight.optics import Slab
from arlight.synthetic.interreflection import Interreflection, diffuse_reflectance

SLAB = Slab(2.44, 1.52)
TEXEL_MM = 0.1


def fresnel(angle):
    inside = np.arcsin(np.sin(angle) / 1.52)
    s = np.sin(angle - inside) / np.sin(angle + inside)
    p = np.tan(angle - inside) / np.tan(angle + inside)
    return (s**2 + p**2) / 2


def monte_carlo(film, radiosity, row, column, generator, rays=200_000):
    """Irradiance at a texel by tracing rays up from it: cosine-distributed in the air gap, refracted, mirrored."""
    sine = np.sqrt(generator.uniform(0, 1, rays))
    azimuth = generator.uniform(0, 2 * np.pi, rays)
    angle = np.arcsin(sine)
    face = fresnel(angle)
    side = 2.44 * np.tan(np.arcsin(sine / 1.52)) / TEXEL_MM
    step = np.stack([side * np.sin(azimuth), side * np.cos(azimuth)])
    crossing = np.rint(np.array([[row], [column]]) + step).astype(int)
    landing = np.rint(np.array([[row], [column]]) + 2 * step).astype(int)
    through = film[crossing[0], crossing[1]] ** 2 * face * (1 - face) ** 2
    upper = np.mean(radiosity[:, landing[0], landing[1]] * through, axis=1)
    return upper + radiosity[:, row, column] * np.mean(face)


def test_returned_light_equals_traced_rays():
    generator = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(200) * TEXEL_MM, np.arange(180) * TEXEL_MM)
    film = (0.95 * (0.5 + 0.5 * np.cos(2 * np.pi * x / 4.26))).astype(np.float32)
    paper = (0.9 * (0.5 + 0.5 * np.cos(2 * np.pi * (x + y) / 3.0))).astype(np.float32)
    irradiance = np.stack([1 + 0.3 * np.sin(x), np.ones_like(x), 1 + 0.2 * np.cos(y)]).astype(np.float32)
    found = Interreflection(film**2, paper, SLAB, TEXEL_MM).returned(irradiance)
    for row, column in generator.integers(70, 110, (12, 2)):
        expected = monte_carlo(film, irradiance * paper, row, column, generator)
        # 3 % of the light that comes back is 0.3 % of the light on the paper
        np.testing.assert_allclose(found[:, row, column], expected, atol=0.003)


def test_bounces_converge_to_the_geometric_series():
    generator = np.random.default_rng(1)
    film, paper = np.full((140, 140), 0.95, np.float32), np.full((140, 140), 0.9, np.float32)
    angle = np.arcsin(np.sqrt(generator.uniform(0, 1, 1_000_000)))
    face = fresnel(angle)
    once = 0.9 * (face.mean() + 0.95**2 * (face * (1 - face) ** 2).mean())
    glass = Interreflection(film**2, paper, SLAB, TEXEL_MM)
    direct = np.ones((3, 140, 140), np.float32)
    middle = [glass.total_irradiance(direct, bounces)[1, 70, 70] for bounces in range(5)]
    # the grid's rim is dark: two bounces do not reach it from the middle, later ones hardly
    np.testing.assert_allclose(middle[1], 1 + once, rtol=2e-3)
    np.testing.assert_allclose(middle[4], 1 / (1 - once), rtol=2e-3)
    assert middle[0] == 1.0
    assert 0.10 < once < 0.20
    # what two bounces leave out
    assert middle[4] - middle[2] < 0.005


def test_returned_light_is_linear_and_does_not_create_energy():
    generator = np.random.default_rng(2)
    film = generator.uniform(0, 0.95, (60, 70)).astype(np.float32)
    paper = generator.uniform(0, 0.9, (60, 70)).astype(np.float32)
    glass = Interreflection(film**2, paper, SLAB, TEXEL_MM)
    a, b = generator.uniform(0, 1, (2, 3, 60, 70)).astype(np.float32)
    np.testing.assert_allclose(glass.returned(a + b), glass.returned(a) + glass.returned(b), atol=1e-6)
    assert glass.returned(a).sum() < 0.2 * (a * paper).sum()


def test_black_paper_returns_nothing():
    film = np.full((30, 30), 0.95, np.float32)
    glass = Interreflection(film**2, np.zeros((30, 30), np.float32), SLAB, TEXEL_MM)
    assert glass.returned(np.ones((3, 30, 30), np.float32)).max() == 0.0


@pytest.mark.parametrize("index", [1.3, 1.52, 1.9])
def test_diffuse_reflectance_equals_monte_carlo(index):
    angle = np.arcsin(np.sqrt(np.random.default_rng(3).uniform(0, 1, 400_000)))
    inside = np.arcsin(np.sin(angle) / index)
    s = np.sin(angle - inside) / np.sin(angle + inside)
    p = np.tan(angle - inside) / np.tan(angle + inside)
    # 4 standard errors of the Monte Carlo
    assert diffuse_reflectance(Slab(1.0, index)) == pytest.approx(np.mean((s**2 + p**2) / 2), abs=4 * 0.12 / 632)
