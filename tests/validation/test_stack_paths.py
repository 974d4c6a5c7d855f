"""Paths made by Mitsuba's dielectric: nothing is lost, and their shares are Fresnel's."""

import numpy as np
import pytest

from arlight.optics import Slab
from arlight.validation.stack_paths import interface_reflectance_table, trace_stack

SLAB = Slab()


@pytest.fixture(scope="module")
def paths(request):
    request.getfixturevalue("path_tracer")
    return trace_stack(SLAB, 11, 10, seed=3)


def share(paths, chosen):
    return paths.weight[chosen].sum() / np.pi


def test_on_white_paper_under_clear_film_all_light_gets_out(paths):
    # what is left in the stack after eight crossings or four hits of the paper is cut off
    assert share(paths, slice(None)) == pytest.approx(1.0, abs=4e-3)
    assert share(paths, slice(None)) < 1.0 + 1e-3


def test_straight_paths_carry_what_two_faces_let_through(paths):
    cosine = (np.arange(20000) + 0.5) / 20000
    face = SLAB.interface_reflectance(cosine)
    straight = (paths.film_count == 1) & (paths.paper_count == 0)
    assert share(paths, straight) == pytest.approx(np.mean(2 * cosine * (1 - face) ** 2), rel=1e-3)


def test_straight_paths_cross_the_film_where_snell_says(paths):
    straight = (paths.film_count == 1) & (paths.paper_count == 0)
    np.testing.assert_allclose(paths.film_mm[straight, 0], SLAB.offset_mm(paths.direction[straight]), atol=2e-6)


def test_a_reflection_by_the_upper_face_returns_twice_as_far_and_crosses_the_film_twice_on_the_spot(paths):
    returned = (paths.film_count == 3) & (paths.paper_count == 1)
    film, paper = paths.film_mm[returned], paths.paper_mm[returned, 0]
    # not those that the lower face sends back first or again: they meet the paper at the start, or leave in line
    first = np.linalg.norm(film[:, 2] - 3.0 * film[:, 0], axis=1) > 1e-3
    assert first.any()
    np.testing.assert_array_equal(film[first, 0], film[first, 1])
    np.testing.assert_allclose(paper[first], 2 * film[first, 0], atol=1e-5)


@pytest.mark.usefixtures("path_tracer")
def test_sets_differ_by_their_seed_and_are_repeated_by_it():
    one, again, other = (trace_stack(SLAB, 4, 3, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.direction, again.direction)
    assert not np.allclose(one.direction[:8], other.direction[:8])


@pytest.mark.usefixtures("path_tracer")
def test_thicker_glass_only_moves_the_crossings():
    thin, thick = (trace_stack(Slab(h), 6, 5, seed=1) for h in (1.0, 2.0))
    np.testing.assert_array_equal(thin.weight, thick.weight)
    np.testing.assert_allclose(thick.film_mm, 2.0 * thin.film_mm, atol=1e-12)


@pytest.mark.usefixtures("path_tracer")
def test_mitsubas_fresnel_is_ours_but_not_from_our_formula():
    table = interface_reflectance_table(SLAB, 257)
    np.testing.assert_allclose(table, SLAB.interface_reflectance(np.linspace(0, 1, 257)), atol=1e-6)
