"""The paper's radiosity against pointwise light, quadrature over directions, and the sum of the geometric series."""

import numpy as np
import pytest
from scipy.integrate import quad

from arlight.estimation.layer_series import HARMONICS, film_series, paper_series
from arlight.estimation.stack import lower_face_return, paper_light, upper_face_return
from arlight.optics import Slab
from arlight.probe.assembly import Print
from arlight.probe.design import Block, Probe

INDEX = 1.52
SLAB = Slab(2.44, INDEX)
ORDERS = np.arange(-HARMONICS, HARMONICS + 1)
PSI = np.random.default_rng(0).uniform(0, 2 * np.pi, 40)


def block_of(kind, frequency=None, phase_deg=None):
    return Block(1, kind, (0.0, 0.0), 12.0, 6.0, frequency, phase_deg)


def probe_of(design="matched", paper=0.9, film=0.95):
    return Probe(design, 5, (160.0, 160.0), 20, 2.44, INDEX, "DICT_4X4_50", (), (), paper, film)


def printed(design, phase_deg, psi):
    """Film and paper as printed, relative to clear film and white paper."""
    tau = np.radians(phase_deg)
    if design == "matched":
        return (1 + np.cos(psi)) / 2, (1 + np.cos(psi + tau)) / 2
    return (1 - np.sin(psi)) / 2, (1 + np.sin(2 * psi + tau)) / 2


def at(series, psi):
    """Values (..., k) of a series -H..H (2 H + 1, k) at phases (...); real."""
    values = np.tensordot(np.exp(1j * np.multiply.outer(psi, ORDERS)), series, axes=1)
    np.testing.assert_allclose(values.imag, 0, atol=1e-12)
    return values.real


def face(angle):
    """Unpolarised reflectance of one face by sines and tangents."""
    inside = np.arcsin(np.sin(angle) / INDEX)
    across = np.sin(angle - inside) / np.sin(angle + inside)
    along = np.tan(angle - inside) / np.tan(angle + inside)
    return 0.5 * (across**2 + along**2)


def diffuse_share(of_face):
    """Mean of a function of the face's reflectance over the cosine-weighted hemisphere."""
    return quad(lambda angle: 2 * np.sin(angle) * np.cos(angle) * of_face(face(angle)), 1e-9, np.pi / 2)[0]


def diffuse_rays(rings, spokes):
    """Rays of diffuse light: their shares, reflectance of the face, sideways travel to the film [mm]."""
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    angle = (nodes[:, None] + 1) * np.pi / 4
    azimuth = (np.arange(spokes) + 0.5) * 2 * np.pi / spokes
    reach = 2.44 * np.tan(np.arcsin(np.sin(angle) / INDEX))
    sideways = np.stack([reach * np.cos(azimuth), reach * np.sin(azimuth)], axis=-1)
    share = np.broadcast_to(weights[:, None] * np.sin(2 * angle) * np.pi / 4 / spokes, sideways.shape[:2])
    return share.ravel(), np.broadcast_to(face(angle), share.shape).ravel(), sideways.reshape(-1, 2)


@pytest.mark.parametrize(("design", "phases"), [("matched", [0, 90, 180, 270]), ("doubled", [0, 90, 37])])
def test_series_are_the_printed_layers(design, phases):
    for phase_deg in phases:
        block = block_of("pattern", (2, 1), float(phase_deg))
        film, paper = printed(design, phase_deg, PSI)
        np.testing.assert_allclose(
            at(film_series((block,), design, Print(), np.zeros((1, 2)))[0], PSI), film, atol=1e-12
        )
        np.testing.assert_allclose(
            at(paper_series((block,), design, Print(), np.zeros((1, 2)))[0], PSI), paper, atol=1e-12
        )


@pytest.mark.parametrize("design", ["matched", "doubled"])
@pytest.mark.parametrize(
    ("kind", "film", "paper"),
    [("clear_white", 1, 1), ("clear_black", 1, 0), ("black_white", 0, 1), ("black_black", 0, 0)],
)
def test_regions_without_pattern_are_uniform(design, kind, film, paper):
    np.testing.assert_allclose(
        at(film_series((block_of(kind),), design, Print(), np.zeros((1, 2)))[0], PSI),
        np.full(PSI.shape, film),
        atol=1e-15,
    )
    np.testing.assert_allclose(
        at(paper_series((block_of(kind),), design, Print(), np.zeros((1, 2)))[0], PSI),
        np.full(PSI.shape, paper),
        atol=1e-15,
    )


@pytest.mark.parametrize(("design", "phase_deg"), [("matched", 90.0), ("matched", 180.0), ("doubled", 0.0)])
def test_without_bounces_paper_is_lit_through_the_film_beside_it(design, phase_deg):
    light = paper_light(probe_of(design), (block_of("pattern", (1, -2), phase_deg),), bounces=False)
    for lamp in (0.0, 1.1, -2.5):  # the lamp's 2 pi n.Delta
        unit = np.array([1.0, np.cos(lamp), -np.sin(lamp)])
        film, _ = printed(design, phase_deg, PSI + lamp)
        _, paper = printed(design, phase_deg, PSI)
        np.testing.assert_allclose(at(light.radiosity[0], PSI) @ unit, 0.95 * film * 0.9 * paper, atol=1e-12)
        np.testing.assert_allclose(at(light.film[0], PSI + lamp), 0.95 * film, atol=1e-12)


@pytest.mark.parametrize(
    ("design", "frequency", "phase_deg"),
    [
        ("matched", (1, 0), 0.0),
        ("matched", (-2, 1), 90.0),
        ("matched", (3, 4), 180.0),
        ("doubled", (0, 1), 0.0),
        ("doubled", (2, 2), 90.0),
    ],
)
def test_with_bounces_every_point_is_in_balance(design, frequency, phase_deg):
    """Radiosity = reflectance times (light through the film + what both faces send back), ray by ray."""
    light = paper_light(probe_of(design), (block_of("pattern", frequency, phase_deg),))
    share, reflectance, sideways = diffuse_rays(64, 128)
    turn = sideways @ np.array(frequency) * 2 * np.pi / SLAB.period_mm
    grid = np.arange(16) * 2 * np.pi / 16
    analysis = np.exp(-1j * np.outer(ORDERS, grid)) / len(grid)
    for lamp in (0.4, 3.0):
        unit = np.array([1.0, np.cos(lamp), -np.sin(lamp)])
        crossed = 0.95 * printed(design, phase_deg, grid[:, None] + turn)[0]
        source = at(light.radiosity[0], grid[:, None] + 2 * turn) @ unit
        returned = (crossed**2 * source) @ (share * reflectance * (1 - reflectance) ** 2)
        returned += share @ reflectance * (at(light.radiosity[0], grid) @ unit)
        entered = 0.95 * printed(design, phase_deg, grid + lamp)[0]
        white = 0.9 * printed(design, phase_deg, grid)[1]
        np.testing.assert_allclose(analysis @ (white * (entered + returned)), light.radiosity[0] @ unit, atol=4e-5)


@pytest.mark.parametrize(("paper", "film"), [(1.0, 1.0), (0.9, 0.95), (0.5, 1.0), (0.9, 0.3)])
def test_uniform_layers_are_the_geometric_series(paper, film):
    once = diffuse_share(lambda r: r) + film**2 * diffuse_share(lambda r: r * (1 - r) ** 2)
    light = paper_light(probe_of("matched", paper, film), (block_of("clear_white"),))
    expected = film * paper * sum((paper * once) ** k for k in range(60))
    assert light.radiosity[0, HARMONICS, 0] == pytest.approx(expected, rel=1e-4)
    # only the mean, and only from the mean
    others = light.radiosity[0].copy()
    others[HARMONICS, 0] = 0
    np.testing.assert_array_equal(others, 0)


def test_bounces_add_the_right_amount_to_white():
    block = (block_of("clear_white"),)
    with_bounces = paper_light(probe_of(), block).radiosity[0, HARMONICS, 0].real
    single = paper_light(probe_of(), block, bounces=False).radiosity[0, HARMONICS, 0].real
    assert 1.05 < with_bounces / single < 1.20
    # not more light than entered can be scattered on by paper that reflects 0.9 of it and glass that returns a share
    assert with_bounces < 0.9 * 0.95 / (1 - 0.9)


@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_bounces_brighten_every_point_of_a_pattern(design):
    phases = (0.0, 90.0)
    blocks = tuple(block_of("pattern", (1, 1), phase_deg) for phase_deg in phases)
    more = paper_light(probe_of(design), blocks).radiosity[..., 0]
    less = paper_light(probe_of(design), blocks, bounces=False).radiosity[..., 0]
    for i in range(2):
        added = at(more[i], PSI) - at(less[i], PSI)
        assert added.min() > -5e-4
        assert 0.04 < np.mean(added) / less[i, HARMONICS].real < 0.2


@pytest.mark.parametrize("kind", ["clear_black", "black_white", "black_black"])
def test_black_layers_give_no_light_back(kind):
    np.testing.assert_array_equal(paper_light(probe_of(), (block_of(kind),)).radiosity, 0)


def test_only_the_length_of_the_frequency_matters():
    blocks = tuple(block_of("pattern", frequency, 90.0) for frequency in [(5, 0), (3, 4), (-4, 3)])
    light = paper_light(probe_of(), blocks)
    np.testing.assert_allclose(light.radiosity[1:], np.broadcast_to(light.radiosity[0], (2, 9, 3)), atol=1e-12)


def test_diffuse_return_of_the_faces():
    assert lower_face_return(SLAB) == pytest.approx(diffuse_share(lambda r: r), rel=1e-5)
    assert upper_face_return(SLAB, 0.0) == pytest.approx(diffuse_share(lambda r: r * (1 - r) ** 2), rel=1e-5)


@pytest.mark.parametrize("frequency", [1.0, np.sqrt(5), 5.0, 15.0])
def test_return_of_the_upper_face_is_the_transform_of_where_rays_land(frequency):
    share, reflectance, sideways = diffuse_rays(100, 256)
    wave = np.cos(2 * np.pi * frequency * sideways[:, 0] / SLAB.period_mm)
    expected = share @ (reflectance * (1 - reflectance) ** 2 * wave)
    assert upper_face_return(SLAB, frequency) == pytest.approx(expected, abs=1e-6)
    assert abs(expected) < upper_face_return(SLAB, 0.0)
