"""The assembled sheet's value: registrations, tones, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arlight.errors import ProbeError
from arlight.probe.assembly import Assembly, BlockCorrections, Print, Registration
from arlight.probe.layout import design_probe

SHIFTS = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


@given(SHIFTS, st.floats(-5, 5), st.floats(0.9, 1.1))
def test_design_points_are_where_the_registration_laid_them(shift, rotation, scale):
    place = Registration(shift, rotation, scale)
    design = np.array([[0.0, 0.0], [50.0, -20.0], [-3.0, 70.0]])
    laid = np.array(shift) + design @ place.matrix.T
    np.testing.assert_allclose(place.design_points(laid), design, atol=1e-9)
    # lengths grow by the scale, directions turn counterclockwise
    assert np.linalg.norm(laid[1] - laid[0]) == pytest.approx(scale * np.linalg.norm(design[1]))
    turned = np.degrees(np.angle(complex(*(Registration((0, 0), rotation).matrix @ [1.0, 0.0]))))
    assert turned == pytest.approx(rotation, abs=1e-9)


@given(st.floats(-5, 5), st.floats(0.9, 1.1))
def test_stripes_keep_their_phase_under_the_registration(rotation, scale):
    place = Registration((0.3, -0.2), rotation, scale)
    cycles, points = np.array([0.7, -0.4]), np.array([[3.0, 4.0], [-60.0, 12.0]])
    laid = np.array([0.3, -0.2]) + points @ place.matrix.T
    phase = (laid - [0.3, -0.2]) @ place.cycles_per_mm(cycles)
    np.testing.assert_allclose(phase, points @ cycles, atol=1e-9)


@given(st.floats(0, 1), st.floats(0, 0.2), st.floats(0, 0.3))
def test_tone_keeps_what_is_unprinted_and_solid_and_darkens_between(value, gain, solid):
    made = Print(dot_gain=gain, solid=solid)
    assert made.tone(1.0) == pytest.approx(1.0)
    assert made.tone(0.0) == pytest.approx(solid)
    assert made.tone(value) <= solid + (1 - solid) * value + 1e-12
    assert np.all(np.diff(made.tone(np.linspace(0, 1, 50))) >= -1e-12)


def test_half_coverage_grows_by_the_dot_gain():
    assert Print(dot_gain=0.1).tone(0.5) == pytest.approx(0.4)


def test_glass_scales_the_light_plane():
    probe = design_probe(order=2)
    slab = Assembly(glass_scale=1.02).slab(probe)
    assert slab.max_offset_mm == pytest.approx(1.02 * probe.slab.max_offset_mm)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Registration((np.nan, 0.0)),
        lambda: Registration(scale=0.0),
        lambda: Print(blur_mm=-0.1),
        lambda: Print(dot_gain=0.4),
        lambda: Print(solid=1.0),
        lambda: Assembly(glass_scale=3.0),
        lambda: BlockCorrections(np.ones(3), np.zeros(3), np.ones(2), np.zeros(3)),
        lambda: BlockCorrections(np.ones(2), np.array([0.0, np.nan]), np.ones(2), np.zeros(2)),
    ],
)
def test_impossible_sheets_are_refused(make):
    with pytest.raises(ProbeError):
        make()
