"""The order `auto` beside every fixed one, on a tiny clip; skies by their name."""

import math

import numpy as np
import pytest

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.order_part import LEAST_FRAMES, OBJECTS, measure_order
from arlight.benchmark.speed.relighters import Relighters
from arlight.benchmark.speed.skies import sky
from arlight.benchmark.speed.tables import benchmark_tables
from arlight.errors import EnvironmentMapError
from arlight.fourier import frequency_order
from arlight.probe.layout import design_probe
from arlight.synthetic.captured import load_environment


@pytest.fixture(scope="module")
def found(clip):
    relighters = Relighters()
    yield measure_order(clip, LEAST_FRAMES, relighters)
    relighters.release()


def test_every_look_is_compared_with_every_order(found, clip):
    rows = found.details["order"]
    assert [row["object"] for row in rows] == list(OBJECTS)
    for row in rows:
        assert row["name"] == clip.workload.name
        assert len(row["error_by_order"]) == len(row["orders"]) == clip.probe.order + 1
        assert sum(row["orders"]) == pytest.approx(1.0)
        assert row["over_best"] == pytest.approx(row["error_of_auto"] / min(row["error_by_order"]))
        assert row["cost_over_all_orders"] > 0.0


def test_light_that_is_well_known_is_drawn_no_worse_than_a_fixed_order_measures_it(found):
    for row in found.details["order"]:
        (taken,) = np.flatnonzero(row["orders"])
        assert row["error_of_auto"] <= 1.001 * row["error_by_order"][taken]


def test_what_is_gated_has_names_of_its_own(found, clip):
    names = {f"{look}, {clip.workload.name}" for look in OBJECTS}
    assert found.errors.keys() == {f"auto over the best order, {name}" for name in names}
    assert found.ratios.keys() == {f"auto over all orders, {name}" for name in names}
    assert all(math.isfinite(error) for error in found.errors.values())


def test_the_table_tells_the_best_order(found):
    rows = [{**row, "error_by_order": [0.25, 0.5]} for row in found.details["order"]]
    (table,) = [table for table in benchmark_tables(Findings(details={"order": rows})) if "auto" in str(table.title)]
    assert next(iter(table.columns[2].cells)) == "0"
    assert next(iter(table.columns[3].cells)) == "25.00"


def test_skies_are_softer_than_what_was_captured():
    probe = design_probe(3)
    order = frequency_order(probe.frequencies)

    def one_sided(environment):
        """Odd part: light that is the same all round has none."""
        coefficients = environment.coefficients(probe.slab, probe.frequencies)
        return np.linalg.norm(coefficients[order == 1].imag) / np.linalg.norm(coefficients[0])

    assert one_sided(sky("overcast")) < 1e-6
    assert 1e-3 < one_sided(sky("haze")) < 0.3 * one_sided(sky("hall"))
    assert np.array_equal(sky("hall").radiance, load_environment("hall").radiance)


def test_an_overcast_sky_is_three_times_as_bright_above():
    up, aside = sky("overcast").radiance_at([[0.0, 0.0, 1.0], [1.0, 0.0, 0.03]])
    assert up / aside == pytest.approx(np.full(3, 3.0), rel=0.1)


def test_an_unknown_sky_is_refused():
    with pytest.raises(EnvironmentMapError, match="no such environment"):
        sky("nowhere")
