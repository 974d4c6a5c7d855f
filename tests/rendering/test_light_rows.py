import numpy as np
import pytest

from arlight.rendering.light_rows import LightRows


@pytest.fixture
def matrices():
    rng = np.random.default_rng(4)
    return [rng.standard_normal((n, 81)).astype(np.float32) for n in (700, 1, 512)]


def test_each_part_is_its_matrix_times_the_light(matrices):
    """But for the rounding of numbers to 16 bits."""
    packed = np.random.default_rng(5).standard_normal((81, 3)).astype(np.float32)
    for matrix, lit in zip(matrices, LightRows(matrices).light(packed), strict=True):
        assert lit.shape == (len(matrix), 4)
        error = np.abs(lit[:, :3] - matrix @ packed)
        assert np.sqrt(np.mean(error**2)) < 1e-4 * np.sqrt(np.mean((matrix @ packed) ** 2))
        assert np.all(lit[:, 3] == 0.0)


def test_rows_of_any_size_are_as_exact_and_rows_of_nothing_stay_so(matrices):
    size = np.geomspace(1e-12, 1e12, 700).astype(np.float32)[:, None]
    size[5] = 0.0
    packed = np.random.default_rng(8).standard_normal((81, 3)).astype(np.float32)
    (lit,) = LightRows([matrices[0] * size]).light(packed)
    assert np.all(np.abs(lit[:, :3] - size * (matrices[0] @ packed)) <= 3e-3 * size)


def test_light_that_changes_and_returns_is_followed(matrices):
    rng = np.random.default_rng(9)
    one, other = rng.standard_normal((2, 81, 3)).astype(np.float32)
    rows = LightRows(matrices)
    first, second, third, fourth = (rows.light(light)[0].copy() for light in (one, other, one, one[:5]))
    assert np.array_equal(first, third)
    assert not np.allclose(first, second)
    assert not np.allclose(first, fourth)


@pytest.mark.parametrize("count", [1, 5, 29, 81])
def test_fewer_coefficients_are_the_others_at_zero(matrices, count):
    packed = np.random.default_rng(6).standard_normal((81, 3)).astype(np.float32)
    packed[count:] = 0.0
    rows = LightRows(matrices)
    whole = [part.copy() for part in rows.light(packed)]
    for cut, expected in zip(rows.light(packed[:count]), whole, strict=True):
        np.testing.assert_allclose(cut, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("count", [1, 9, 29, 81])
def test_with_independent_parts_fewer_coefficients_predict_the_others(matrices, reconstruction, count):
    packed = np.random.default_rng(7).standard_normal((count, 3))
    rows = LightRows(matrices, reconstruction.independent)
    completed = reconstruction.completed(packed)
    np.testing.assert_allclose(completed[:count], packed, atol=1e-9)
    stored = [matrix @ reconstruction.independent for matrix in matrices]
    unit = np.sqrt(np.mean(np.concatenate(stored) ** 2, axis=0))
    factors = np.abs(np.linalg.solve(reconstruction.independent, completed)) * unit[:, None]
    for matrix, parts, lit in zip(matrices, stored, rows.light(packed), strict=True):
        # half a step of each number, and single precision
        rounded = np.abs(parts / unit).max(axis=1, keepdims=True) / 32767.0 * 0.5 * factors.sum(axis=0)
        assert np.all(np.abs(lit[:, :3] - matrix @ completed) < rounded + 1e-5 * (np.abs(parts / unit) @ factors))


@pytest.mark.parametrize("shape", [(82, 3), (81, 2), (81,)])
def test_light_of_another_shape_is_refused(matrices, shape):
    with pytest.raises(ValueError, match="81"):
        LightRows(matrices).light(np.zeros(shape, np.float32))
