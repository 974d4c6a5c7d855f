import numpy as np
import pytest
from scipy.special import gamma, kv

from arlight.estimation.reflection import field_amplitude, reflection_basis

LENGTH_MM = 40.0


def grid_of(side, spacing_mm):
    axis = (np.arange(side) - (side - 1) / 2) * spacing_mm
    return np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)


def matern(distance, smoothness=1.5):
    """The general Matern covariance by its Bessel function."""
    scaled = np.sqrt(2 * smoothness) * np.maximum(distance, 1e-9) / LENGTH_MM
    return 2 ** (1 - smoothness) / gamma(smoothness) * scaled**smoothness * kv(smoothness, scaled)


@pytest.mark.parametrize(
    "centers", [grid_of(10, 13.0), grid_of(4, 40.0), np.random.default_rng(0).normal(0, 60, (50, 2))]
)
def test_unit_amplitudes_make_a_matern_field(centers):
    basis = reflection_basis(centers)
    distance = np.linalg.norm(centers[:, None] - centers[None], axis=-1)
    covariance = basis[:, 1:] @ basis[:, 1:].T
    # what is left out is below half a per cent of the strongest direction's variance
    left_out = np.linalg.norm(matern(distance) - covariance, 2)
    assert left_out <= 5e-3 * np.linalg.norm(matern(distance), 2)


def test_fewer_numbers_than_blocks_describe_the_field():
    basis = reflection_basis(grid_of(12, 13.0))
    assert basis.shape[1] < 0.6 * 144
    # blocks closer together say little more about it
    assert reflection_basis(grid_of(24, 6.5)).shape[1] < 1.5 * basis.shape[1]
    np.testing.assert_array_equal(basis[:, 0], 1)
    # independent amplitudes: the fields are orthogonal over the blocks
    gram = basis[:, 1:].T @ basis[:, 1:]
    np.testing.assert_allclose(gram - np.diag(np.diag(gram)), 0, atol=1e-9)


def test_a_window_mirrored_in_the_film_is_within_reach():
    centers = grid_of(10, 13.0)
    window = np.exp(-np.sum((centers - [20, -10]) ** 2, axis=1) / (2 * 35.0**2))
    basis = reflection_basis(centers)
    amplitudes, *_ = np.linalg.lstsq(basis, window, rcond=None)
    np.testing.assert_allclose(basis @ amplitudes, window, atol=0.01)


def test_the_basis_does_not_care_where_the_sheet_lies():
    centers = np.random.default_rng(1).normal(0, 50, (30, 2))
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    there, here = (b @ b.T for b in (reflection_basis(centers), reflection_basis(centers @ turn.T + [300, -20])))
    np.testing.assert_allclose(here, there, atol=1e-9)


@pytest.mark.parametrize("centers", [np.zeros((1, 2)), np.zeros((3, 2)), grid_of(2, 1e-6)])
def test_blocks_in_one_place_have_one_reflection(centers):
    basis = reflection_basis(centers)
    assert np.all(np.isfinite(basis))
    np.testing.assert_allclose(basis[:, 1:] @ basis[:, 1:].T, 1, atol=1e-6)


def test_amplitude_is_the_fields_spread_whatever_its_level():
    observed = np.random.default_rng(2).normal(0.3, 0.02, 4000)
    # 1.5 times the median deviation is the standard deviation of a Gaussian to 1.2 %
    assert field_amplitude(observed, 1e-4) == pytest.approx(0.02, rel=0.05)
    assert field_amplitude(observed + 5, 1e-4) == pytest.approx(field_amplitude(observed, 1e-4), rel=1e-9)


def test_a_mirrored_patch_sets_the_amplitude_and_a_lamp_counts_as_one():
    observed = np.random.default_rng(3).normal(0.1, 0.01, 20)
    patch, lamp = observed.copy(), observed.copy()
    patch[:3] += 0.05
    lamp[:3] = 1.0
    assert field_amplitude(patch, 1e-4) == pytest.approx(np.std(patch), rel=1e-6)
    assert 0.02 < field_amplitude(lamp, 1e-4) < 0.1


def test_amplitude_has_a_floor_and_is_wide_where_little_was_seen():
    assert field_amplitude(np.full(9, 0.2), 1e-3) == 1e-3
    for few in ([], [0.5], [0.5, 0.5]):
        assert field_amplitude(np.array(few), 1e-3) > 1e-3
