"""J_0 against scipy's."""

import numpy as np
import scipy.special

from arlight.estimation.bessel import bessel_j0


def test_is_scipys_j0_near_and_far():
    x = np.concatenate([np.linspace(0.0, 10.0, 20001), np.geomspace(10.0, 1e4, 20001)])
    np.testing.assert_allclose(bessel_j0(x), scipy.special.j0(x), atol=1e-7)


def test_keeps_the_shape():
    assert bessel_j0(np.zeros((2, 3))).tolist() == [[1.0] * 3] * 2
    assert bessel_j0(0.0).shape == ()
