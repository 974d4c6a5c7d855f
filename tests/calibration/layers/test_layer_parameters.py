"""The vector of the layers' parameters, and the assembly that it describes."""

from dataclasses import fields

import numpy as np
import pytest

from arlight.calibration.layers.layer_parameters import (
    EXPECTED,
    HIGH,
    LOW,
    NAMES,
    PARAMETERS,
    STDDEV,
    STEP,
    assembly_of,
    vector_of,
)
from arlight.probe.assembly import Assembly, Print, Registration

OF_THE_SHEET = NAMES[: NAMES.index("vignetting_k1")]


@pytest.mark.parametrize("seed", range(5))
def test_a_vector_survives_the_assembly(seed):
    away = np.random.default_rng(seed).normal(size=len(NAMES))
    vector = np.clip(EXPECTED + 1.5 * STDDEV * away, LOW, HIGH)
    again = vector_of(assembly_of(vector))
    for name, before, after, expected in zip(NAMES, vector, again, EXPECTED, strict=True):
        assert after == pytest.approx(before if name in OF_THE_SHEET else expected, abs=1e-12)


def test_an_assembly_survives_the_vector():
    assembly = Assembly(
        Print(Registration((0.1, -0.2), 0.3, 1.001), 0.05, 0.07, 0.02),
        Print(Registration((-0.3, 0.4), -0.5, 0.998), 0.09, -0.04, 0.05),
        1.07,
    )
    again = assembly_of(vector_of(assembly))
    for layer in ("film", "paper"):
        before, after = getattr(assembly, layer), getattr(again, layer)
        for part in fields(Print):
            if part.name != "registration":
                assert getattr(after, part.name) == pytest.approx(getattr(before, part.name))
        assert after.registration == before.registration
    assert again.glass_scale == assembly.glass_scale


def test_each_parameter_moves_its_own_value_alone():
    base = vector_of(assembly_of(EXPECTED))
    for column, name in enumerate(OF_THE_SHEET):
        step = np.zeros(len(NAMES))
        step[column] = STEP[column]
        np.testing.assert_allclose(vector_of(assembly_of(EXPECTED + step)) - base, step, atol=1e-12, err_msg=name)


def test_variances_and_solids_below_zero_count_as_none():
    vector = EXPECTED.copy()
    for name in ("film_blur_mm2", "paper_blur_mm2", "film_solid", "paper_solid"):
        vector[NAMES.index(name)] = -1e-3
    assembly = assembly_of(vector)
    for layer in (assembly.film, assembly.paper):
        assert (layer.blur_mm, layer.solid) == (0.0, 0.0)


@pytest.mark.parametrize("end", [LOW, HIGH])
def test_every_limit_is_a_sheet_that_can_be(end):
    vector = np.where(np.isfinite(end), end, EXPECTED)
    sheet = vector_of(assembly_of(vector))
    layers = slice(0, NAMES.index("vignetting_k1"))
    np.testing.assert_allclose(sheet[layers], vector[layers], atol=1e-12)


def test_steps_are_small_and_begin_inside_the_limits():
    assert len(set(NAMES)) == len(PARAMETERS)
    assert np.all((LOW <= EXPECTED) & (EXPECTED + STEP <= HIGH))
    assert np.all((STEP > 0) & (STEP <= 0.2 * STDDEV))
