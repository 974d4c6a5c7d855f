"""A designed sheet measures every frequency; geometry that knows nothing of the design's formulas agrees with it."""

from collections import Counter

import numpy as np
import pytest

from arlight.errors import ProbeError
from arlight.optics import Slab
from arlight.probe.frame_layout import window_mm
from arlight.probe.layout import block_size_mm, design_probe, largest_order, require_page
from arlight.probe.pages import fits_page

SHEETS = [(order, design, 2.44, 1.52) for order in range(1, 9) for design in ("matched", "doubled")]
SHEETS += [(3, "matched", 1.1, 1.52), (2, "doubled", 6.0, 1.49), (4, "matched", 2.0, 1.9), (2, "matched", 3.0, 1.1)]


def boxes(blocks):
    centre = np.array([block.center_mm for block in blocks])
    half = np.array([block.size_mm for block in blocks])[:, None] / 2.0
    return centre - half, centre + half


def refracted(direction, index):
    """Vector form of Snell's law for a ray travelling down through z = 0: the direction in the glass."""
    cos_air = -direction[..., 2:]
    cos_glass = np.sqrt(1.0 - (1.0 - cos_air**2) / index**2)
    normal = np.array([0.0, 0.0, 1.0])
    return direction / index + (cos_air / index - cos_glass) * normal


def random_directions(rng, count, limit_deg):
    theta, phi = np.radians(rng.uniform(0.0, limit_deg, count)), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


@pytest.mark.parametrize(("order", "design", "glass", "index"), SHEETS)
def test_every_frequency_has_its_phases(order, design, glass, index):
    probe = design_probe(order, design, glass, index)
    phases = (0.0, 90.0, 180.0, 270.0) if design == "matched" else (0.0, 90.0)
    found = Counter((b.frequency, b.phase_deg) for b in probe.blocks if b.kind == "pattern")
    # half the lattice points of the disk, without the origin
    half = {
        (u, v)
        for u in range(-order, order + 1)
        for v in range(order + 1)
        if 0 < u * u + v * v <= order**2 and (v > 0 or u > 0)
    }
    assert found == Counter({(n, tau): 1 for n in half for tau in phases})


@pytest.mark.parametrize(("order", "design", "glass", "index"), SHEETS)
def test_blocks_fill_the_window_without_overlap(order, design, glass, index):
    probe = design_probe(order, design, glass, index)
    field = [b for b in probe.blocks if b.kind != "wedge"]
    low, high = boxes(field)
    for i in range(len(field)):
        shared = np.minimum(high[i], high[i + 1 :]) - np.maximum(low[i], low[i + 1 :])
        assert not np.any(np.all(shared > 1e-9, axis=1))
    extent = high.max(axis=0) - low.min(axis=0)
    assert np.prod(extent) == pytest.approx(sum(b.size_mm**2 for b in field))
    # centred, and inside the window by the same small gap everywhere
    np.testing.assert_allclose(high.max(axis=0), -low.min(axis=0), atol=1e-9)
    gap = (np.array(window_mm(probe)) - extent) / 2.0
    assert np.all((gap > 0.0) & (gap < 1.0))


@pytest.mark.parametrize(("order", "design", "glass", "index"), SHEETS)
def test_frame_parts_are_clear_of_each_other(order, design, glass, index):
    probe = design_probe(order, design, glass, index)
    corners = np.array([marker.corners_mm for marker in probe.markers])
    side = np.ptp(corners[0], axis=0)[0]
    module = side / 6.0
    marker_low, marker_high = corners.min(axis=1), corners.max(axis=1)
    window = np.array(window_mm(probe)) / 2.0
    wedge_low, wedge_high = boxes([b for b in probe.blocks if b.kind == "wedge"])
    parts_low = np.vstack([marker_low, wedge_low, -window[None]])
    parts_high = np.vstack([marker_high, wedge_high, window[None]])
    outline = np.array(probe.sheet_mm) / 2.0
    assert side >= 14.0
    assert np.all(marker_low - module >= -outline)
    assert np.all(marker_high + module <= outline)
    for i in range(len(corners)):
        # every other part stays out of the marker's quiet zone, a module wide
        others = np.arange(len(parts_low)) != i
        shared = np.minimum(parts_high[others], marker_high[i] + module) - np.maximum(
            parts_low[others], marker_low[i] - module
        )
        assert not np.any(np.all(shared > 1e-9, axis=1))
    for low, high in zip(wedge_low, wedge_high, strict=True):
        shared = np.minimum(parts_high, high) - np.maximum(parts_low, low)
        assert np.sum(np.all(shared > 1e-9, axis=1)) == 1
        assert np.all(np.abs([low, high]) <= outline)


@pytest.mark.parametrize(("order", "design", "glass", "index"), SHEETS)
def test_fiducials_and_wedge_are_enough(order, design, glass, index):
    probe = design_probe(order, design, glass, index)
    wedge = {b.reflectance for b in probe.blocks if b.kind == "wedge"}
    assert len(wedge) >= 8
    assert max(wedge) == 1.0
    assert min(wedge) == pytest.approx(0.03, abs=1e-6)
    assert len(probe.markers) >= 8
    assert sorted(marker.id for marker in probe.markers) == list(range(len(probe.markers)))
    assert [block.id for block in probe.blocks] == list(range(len(probe.blocks)))


@pytest.mark.parametrize("view_limit_deg", [70.0])
@pytest.mark.parametrize(("glass", "index"), [(2.44, 1.52), (5.0, 1.9), (1.0, 1.2)])
def test_window_is_seen_and_lit_through_its_own_block_only(glass, index, view_limit_deg):
    probe = design_probe(1, glass_mm=glass, refractive_index=index)
    block = next(b for b in probe.blocks if b.kind == "pattern")
    rng = np.random.default_rng(7)
    count = 20000
    on_film = rng.uniform(-0.5, 0.5, (count, 2)) * block.window_mm
    on_film[: count // 2] = np.sign(on_film[: count // 2]) * block.window_mm / 2.0
    # the eye's ray goes down into the glass, the light's ray came down to where that one ended
    seen = refracted(-random_directions(rng, count, view_limit_deg), index)
    on_paper = on_film + seen[:, :2] / -seen[:, 2:] * glass
    lit = refracted(-random_directions(rng, count, 90.0), index)
    entered = on_paper - lit[:, :2] / -lit[:, 2:] * glass
    for crossing in (on_paper, entered):
        assert np.abs(crossing).max() <= block.size_mm / 2.0
    # and the block is no larger than that takes: the worst of random rays comes near its edge
    assert np.abs(entered).max() >= 0.97 * block.size_mm / 2.0


def test_default_block_measures_12_364_mm():
    # 4.263025 mm of window, 2.131512 and 1.919138 mm of margin for light and viewer, computed by hand
    assert block_size_mm(Slab()) == pytest.approx(12.364326, abs=1e-6)


@pytest.mark.parametrize("periods", [1, 2])
@pytest.mark.parametrize("design", ["matched", "doubled"])
def test_window_holds_whole_periods(design, periods):
    probe = design_probe(3, design, window_periods=periods)
    samples = (np.arange(240) + 0.5) / 240 - 0.5
    for block in probe.blocks:
        if block.kind != "pattern":
            continue
        x, y = (centre + samples * block.window_mm for centre in block.center_mm)
        u, v = block.frequency
        wave = np.exp(2j * np.pi * (u * x[None, :] + v * y[:, None]) / probe.slab.period_mm)
        # no first or second harmonic is left in the mean, wherever the block stands
        assert abs(wave.mean()) < 1e-9
        assert abs((wave**2).mean()) < 1e-9


def test_phases_of_a_frequency_are_neighbours():
    probe = design_probe(5)
    places: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for block in probe.blocks:
        if block.frequency is not None:
            places.setdefault(block.frequency, []).append(block.center_mm)
    for group in places.values():
        distance = np.linalg.norm(np.array(group)[:, None] - np.array(group)[None], axis=-1) / probe.blocks[0].size_mm
        assert distance.max() <= np.sqrt(5.0) + 1e-9
        # each is beside another one, or at its corner where a reference stands in the way
        assert np.all(np.sort(distance, axis=1)[:, 1] <= np.sqrt(2.0) + 1e-9)


def test_black_references_are_near_everywhere():
    probe = design_probe(5)
    centres = {
        kind: np.array([b.center_mm for b in probe.blocks if b.kind == kind])
        for kind in ("pattern", "black_black", "black_white")
    }
    black = np.vstack([centres["black_black"], centres["black_white"]])
    to_black = np.linalg.norm(centres["pattern"][:, None] - centres["black_black"][None], axis=-1).min(axis=1)
    to_either = np.linalg.norm(centres["pattern"][:, None] - black[None], axis=-1).min(axis=1)
    assert to_black.max() <= 4.2 * probe.blocks[0].size_mm
    assert to_black.mean() <= 2.2 * probe.blocks[0].size_mm
    assert to_either.mean() < to_black.mean()


@pytest.mark.parametrize("paper", ["a4", "letter"])
def test_default_sheet_fits_both_pages(paper):
    assert fits_page(design_probe().sheet_mm, paper)
    assert design_probe(paper=paper).order == 5


@pytest.mark.parametrize("paper", ["a4", "letter"])
@pytest.mark.parametrize("design", ["matched", "doubled"])
@pytest.mark.parametrize("glass", [2.44, 4.0])
def test_largest_order_that_fits_is_named(design, paper, glass):
    fitting = []
    for order in range(1, 9):
        try:
            fitting.append(design_probe(order, design, glass, paper=paper).order)
        except ProbeError as error:
            message = str(error)
    assert largest_order(design_probe(8, design, glass), paper) == max(fitting)
    if max(fitting) < 8:
        assert f"the largest order that fits is {max(fitting)}" in message


def test_nothing_fits_with_very_thick_glass():
    with pytest.raises(ProbeError, match="no order fits; choose thinner glass"):
        require_page(design_probe(1, glass_mm=20.0), "a4")


def test_larger_windows_and_other_resolutions():
    probe = design_probe(2, pixels_per_mm=11.811, window_periods=3)
    assert probe.blocks[0].window_mm == pytest.approx(3 * probe.slab.period_mm)
    pixels = np.array([m.corners_mm for m in probe.markers]) * 11.811 + np.array(probe.sheet_mm) / 2.0 * 11.811
    # fiducials keep to whole pixels at any resolution
    np.testing.assert_allclose(pixels, np.round(pixels), atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"order": 0}, "order"),
        ({"order": 9}, "order"),
        ({"design": "woven"}, "design must be one of matched, doubled"),
        ({"glass_mm": -1.0}, "glass_mm"),
        ({"glass_mm": float("nan")}, "glass_mm"),
        ({"refractive_index": 1.0}, "refractive_index"),
        ({"window_periods": 0}, "window_periods"),
        ({"paper": "a5"}, "paper must be one of a4, letter"),
        ({"paper_reflectance": 0.0}, "paper_reflectance"),
        ({"film_transmittance": 1.2}, "film_transmittance"),
        ({"pixels_per_mm": 0.0}, "pixels_per_mm"),
        ({"glass_mm": 0.1}, "at least .* per mm are needed"),
        ({"glass_mm": 400.0}, "thinner glass"),
    ],
)
def test_impossible_designs_are_refused(arguments, message):
    with pytest.raises(ProbeError, match=message):
        design_probe(**arguments)
