import numpy as np
import pytest

from arlight.rendering.light_rows import LightRows


@pytest.fixture
def matrices():
    rng = np.random.default_rng(4)
    return [rng.standard_normal((n, 81)).astype(np.float32) for n in (700, 1, 512)]


def test_each_part_is_its_matrix_times_the_light(matrices):
    packed = np.random.default_rng(5).standard_normal((81, 3)).astype(np.float32)
    for matrix, lit in zip(matrices, LightRows(matrices).light(packed), strict=True):
        np.testing.assert_allclose(lit.T, matrix @ packed, rtol=1e-4, atol=1e-4)


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
    for matrix, lit in zip(matrices, rows.light(packed), strict=True):
        expected = matrix @ completed
        np.testing.assert_allclose(lit.T, expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.parametrize("shape", [(82, 3), (81, 2), (81,)])
def test_light_of_another_shape_is_refused(matrices, shape):
    with pytest.raises(ValueError, match="81"):
        LightRows(matrices).light(np.zeros(shape, np.float32))
