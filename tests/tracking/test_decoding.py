"""Light of encoded values and back, whether the footage's curve is believed or the camera's was measured."""

import numpy as np
import pytest

from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.radiometry import Radiometry
from arlight.tracking.decoding import decoding

MEASURED = Radiometry(tuple(np.linspace(0.0, 1.0, 65) ** 2.0), black=0.02, clip=0.8)
TRANSFERS = ["srgb", "bt709", "gamma22", "gamma28", "hlg", "linear"]


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_without_radiometry_the_footage_s_curve_is_believed(transfer):
    curve = decoding(transfer)
    encoded = np.linspace(-0.1, 1.1, 997)
    # between two samples of a curve with a kink
    np.testing.assert_allclose(curve.linear(encoded), linear_from_encoded(encoded, transfer), atol=1e-5)
    light = np.linspace(0.0, 1.0, 997)
    np.testing.assert_allclose(curve.encoded(light), encoded_from_linear(light, transfer), atol=3e-4)


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_what_the_camera_says_goes_before_what_the_footage_claims(transfer):
    curve = decoding(transfer, MEASURED)
    assert curve.clip == MEASURED.clip != decoding(transfer).clip
    encoded = np.linspace(0.0, 1.0, 997)
    # a square through 65 knots, of which black is taken off: what lies below is negative light
    np.testing.assert_allclose(curve.linear(encoded), (encoded**2 - 0.02) / 0.98, atol=1 / 64**2 / 4)


@pytest.mark.parametrize("radiometry", [None, MEASURED])
@pytest.mark.parametrize("transfer", TRANSFERS)
def test_light_is_encoded_as_it_is_decoded(transfer, radiometry):
    curve = decoding(transfer, radiometry)
    light = np.linspace(0.0, 1.0, 997)
    np.testing.assert_allclose(curve.linear(curve.encoded(light)), light, atol=1e-4)
    assert np.all(np.diff(curve.encoded(light)) > 0.0)
    # there is no darker picture than black
    assert curve.encoded(-0.5) == curve.encoded(0.0)
