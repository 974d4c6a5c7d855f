from typing import get_args

import numpy as np
import pytest

from arlight.color import Transfer, encoded_from_linear, linear_from_encoded

TRANSFERS = get_args(Transfer)


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_encoding_inverts_decoding(transfer):
    encoded = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(
        encoded_from_linear(linear_from_encoded(encoded, transfer), transfer), encoded, atol=3e-4
    )
    linear = np.linspace(0, 1, 1001) ** 3
    np.testing.assert_allclose(linear_from_encoded(encoded_from_linear(linear, transfer), transfer), linear, atol=1e-3)


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_curves_rise_from_0_to_1_without_a_jump(transfer):
    linear = linear_from_encoded(np.linspace(0, 1, 4001), transfer)
    assert linear[0] == 0
    assert linear[-1] == pytest.approx(1, abs=1e-5)
    assert np.all(np.diff(linear) >= 0)
    assert np.diff(linear).max() < 6 / 4000


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_values_outside_are_clamped(transfer):
    np.testing.assert_allclose(linear_from_encoded([-1, 2], transfer), [0, 1], atol=1e-5)
    np.testing.assert_allclose(encoded_from_linear([-1, 2], transfer), [0, 1], atol=1e-5)


@pytest.mark.parametrize(
    ("transfer", "encoded", "linear"),
    [
        ("srgb", 188 / 255, 0.5029),  # the byte nearest to half the light
        ("srgb", 0.5, 0.21404),
        ("bt709", 0.409007, 0.18),  # an 18 % grey card
        ("hlg", 0.5, 1 / 12),  # the knee of BT.2100
        ("hlg", 0.75, 0.265),  # its reference white: 203 of 1000 cd/m2 before the system gamma
        ("gamma22", 0.5, 0.217638),
        ("gamma28", 0.5, 0.143587),
        ("linear", 0.3, 0.3),
    ],
)
def test_published_points(transfer, encoded, linear):
    assert linear_from_encoded(encoded, transfer) == pytest.approx(linear, rel=1e-3)
