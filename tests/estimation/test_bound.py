"""The bound against a Jacobian taken column by column, against least squares on noise, and against a noisy sensor."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.color import linear_from_encoded
from arlight.estimation.bound import CramerRaoBound, sensor_variance
from arlight.fourier import unpack_real
from arlight.synthetic.sensor import Sensor
from arlight.tracking.block_layout import field_blocks

BLUR = 0.5


@pytest.fixture(scope="module")
def bound(probe):
    return CramerRaoBound(probe)


@pytest.fixture(scope="module")
def measured(blank):
    """Measurements with error bars that are not diagonal, as of blocks that are not whole periods of their stripes."""
    means = blank()
    generator = np.random.default_rng(1)
    covariance = means.covariance.copy()
    for block, harmonics in enumerate(means.harmonics):
        rows = 1 + 2 * harmonics
        factors = generator.normal(size=(rows, 60))
        covariance[block, :rows, :rows] = factors @ factors.T / 60 / 400
    return replace(means, covariance=covariance)


def jacobian(lit_as_usual, means, size):
    """(blocks, 7, size) change of every row with every packed coefficient."""
    columns = []
    for k in range(size):
        packed = np.zeros((size, 3))
        packed[k] = 1.0
        columns.append(lit_as_usual(means, unpack_real(packed), blur_variance_px2=BLUR).values[:, :, 0])
    return np.stack(columns, axis=-1)


def whitened(means, matrix, pixel_variance):
    """Rows (n, ...) of unit variance, of all blocks that were seen."""
    rows = []
    for block in np.flatnonzero(means.valid):
        kept = 1 + 2 * means.harmonics[block]
        factor = np.linalg.cholesky(means.covariance[block, :kept, :kept] * pixel_variance[block])
        rows.append(np.linalg.solve(factor, matrix[block, :kept]))
    return np.concatenate(rows)


def complex_stddev(variance):
    return np.sqrt(np.concatenate([variance[:1], variance[1::2] + variance[2::2]]))


def test_the_bound_is_the_inverse_information(probe, bound, measured, lit_as_usual):
    size = 2 * len(probe.frequencies) - 1
    pixel_variance = np.random.default_rng(2).uniform(1.0, 9.0, (len(measured.valid), 3)) * 1e-5
    full = jacobian(lit_as_usual, measured, size)
    found = bound.stddev(measured, pixel_variance, BLUR)
    for channel in range(3):
        rows = whitened(measured, full, pixel_variance[:, channel])
        expected = complex_stddev(np.diagonal(np.linalg.inv(rows.T @ rows)))
        np.testing.assert_allclose(found[:, channel], expected, rtol=1e-6)


def test_least_squares_on_pure_noise_reaches_it(probe, bound, measured, lit_as_usual):
    size = 2 * len(probe.frequencies) - 1
    pixel_variance = np.full((len(measured.valid), 3), 4e-5)
    rows = whitened(measured, jacobian(lit_as_usual, measured, size), pixel_variance[:, 0])
    noise = np.random.default_rng(3).normal(size=(len(rows), 4000))
    errors, *_ = np.linalg.lstsq(rows, noise)
    found = bound.stddev(measured, pixel_variance, BLUR)[:, 0]
    np.testing.assert_allclose(complex_stddev(errors.var(axis=1)), found, rtol=0.05)


def test_the_bound_falls_with_the_pixels_and_rises_with_their_noise(bound, blank):
    quiet = np.full((len(blank().valid), 3), 1e-5)
    base = bound.stddev(blank(), quiet, BLUR)
    np.testing.assert_allclose(bound.stddev(blank(samples=1600), quiet, BLUR), base / 2.0, rtol=1e-9)
    np.testing.assert_allclose(bound.stddev(blank(), 9.0 * quiet, BLUR), 3.0 * base, rtol=1e-9)
    # the means alone still tell something, stripes that blur has left tell more
    soft, gone = (bound.stddev(blank(), quiet, blur) for blur in (2.0, 1e4))
    assert np.all(soft[1:] > base[1:])
    assert np.all(gone[1:] > soft[1:])
    assert np.all(np.isfinite(gone))


def test_a_hidden_block_never_helps(probe, bound, blank):
    means = blank()
    noise = np.full((len(means.valid), 3), 1e-5)
    full = bound.stddev(means, noise, BLUR)
    blocks = field_blocks(probe)
    for hidden in np.random.default_rng(4).permutation(len(blocks))[:20]:
        part = bound.stddev(replace(means, valid=np.arange(len(means.valid)) != hidden), noise, BLUR)
        assert np.all(part >= full * (1 - 1e-9))
        # black film passes no light
        assert np.any(part > full) == (blocks[hidden].kind in ("pattern", "clear_white"))


def test_what_no_block_saw_is_unbounded(probe, bound, blank):
    means = blank()
    noise = np.full((len(means.valid), 3), 1e-5)
    own = [block.frequency in (None, (0, 1)) for block in field_blocks(probe)]
    found = bound.stddev(replace(means, valid=np.array(own)), noise, BLUR)
    seen = np.array([tuple(n) in ((0, 0), (0, 1)) for n in probe.frequencies.tolist()])
    assert np.all(np.isfinite(found[seen]))
    assert np.all(np.isinf(found[~seen]))
    assert np.all(np.isinf(bound.stddev(replace(means, valid=np.zeros(len(own), bool)), noise, BLUR)))


@pytest.mark.parametrize(
    ("level", "read_noise", "gain"),
    [
        *((level, 0.004, 1e-4) for level in (0.02, 0.2, 0.7)),
        *((level, 0.0, 2e-4) for level in (0.002, 0.02, 0.2, 0.7)),
        *((level, 0.0, 0.0) for level in (0.02, 0.2, 0.6)),
    ],
)
def test_sensor_variance_is_that_of_pictures_it_takes(level, read_noise, gain):
    # a ramp over many levels, for rounding is not random on a constant
    ramp = (level * np.linspace(0.5, 1.5, 160 * 120)).reshape(120, 160)
    radiance = np.repeat(ramp[..., None], 3, axis=2).astype(np.float32)
    camera = Camera((160, 120), np.array([[100.0, 0, 80], [0, 100, 60], [0, 0, 1]]), np.zeros(5))
    picture = Sensor(0.0, 0.0, read_noise, gain).expose(radiance, camera, np.random.default_rng(5))
    seen = ramp < 0.9
    noise = (linear_from_encoded(picture / 255.0) - radiance)[seen]
    expected = sensor_variance(radiance[seen], read_noise, gain)
    # 3e4 pixels or more: 1 % of a variance; in the dark a level is not small against the curve's bend
    assert np.mean(noise**2) == pytest.approx(expected.mean(), rel=0.06)
