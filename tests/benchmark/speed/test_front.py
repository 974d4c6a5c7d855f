"""The front: which points are on it, and how wrong a picture is."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from arlight.benchmark.speed.front import measure_front, pareto
from arlight.benchmark.speed.front_settings import FrontSetting, front_settings
from arlight.benchmark.speed.relighters import Relighters
from arlight.lighting_tracker import TrackerSettings
from arlight.presets import PRESETS, Preset
from arlight.rendering.settings import RelightSettings

POINTS = arrays(float, st.tuples(st.integers(1, 12), st.just(2)), elements=st.integers(0, 5).map(float))


@given(POINTS)
def test_a_point_is_off_the_front_exactly_where_another_beats_it(points):
    on = pareto(points)
    assert on.any()
    for i, point in enumerate(points):
        beaten = any(np.all(other <= point) and np.any(other < point) for other in points)
        assert on[i] == (not beaten)


@given(POINTS, st.floats(0.1, 10.0))
def test_units_do_not_matter(points, factor):
    assert np.array_equal(pareto(points), pareto(points * [factor, 1.0]))


def test_every_setting_has_a_name_of_its_own_and_differs():
    for quick in (True, False):
        settings = front_settings(quick)
        assert [setting.name for setting in settings[:3]] == list(PRESETS)
        assert len({setting.name for setting in settings}) == len(settings)
        assert len({repr(setting.preset) for setting in settings}) == len(settings)
    assert len(front_settings(quick=False)) >= 12
    assert set(front_settings(quick=True)) <= set(front_settings(quick=False))


def test_all_points_are_measured_and_coarser_ones_are_worse(clip):
    coarse = RelightSettings(directions=64, shadow_texels=32, supersampling=1)
    usual = replace(coarse, supersampling=2)
    settings = [
        FrontSetting("fine", Preset(TrackerSettings(order=1), usual), is_preset=True),
        FrontSetting("order 0", Preset(TrackerSettings(order=0), usual)),
        FrontSetting("coarse", Preset(TrackerSettings(order=1), coarse)),
    ]
    relighters = Relighters()
    try:
        found = measure_front(settings, [clip], 8, relighters)
    finally:
        relighters.release()
    fine, dark, blocky = found.details["front"]
    assert dark["coefficient_error"] > 3.0 * fine["coefficient_error"]
    assert dark["relighting_error"] > fine["relighting_error"]
    assert blocky["relighting_error"] > fine["relighting_error"]
    assert blocky["coefficient_error"] == fine["coefficient_error"]
    assert all(point["cost_ms"]["count"] == 1 for point in found.details["front"])
    # only what users know by name is gated
    assert set(found.ratios) == {"track to filter, preset fine"}
    assert set(fine["stages_ms"]) == {"track", "measure", "estimate", "filter", "relight"}
    assert found.errors == {
        "relit picture, preset fine": fine["relighting_error"],
        "light, preset fine": fine["coefficient_error"],
    }
