"""L = M V on linear worlds of known answer, and its file."""

import numpy as np
import pytest

from arlight.errors import CalibrationError, OutputError
from arlight.estimation.fixed_estimator import FixedCalibration, FixedEstimator, ReferenceRegions, fixed_calibration
from arlight.fourier import pack_real, unpack_real
from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import field_blocks


def calibrated(probe, blank, lit, random_light, seeds, mirrored=0.0):
    lights = [random_light(seed) for seed in seeds]
    means = [lit(blank(), light, mirrored=mirrored) for light in lights]
    return fixed_calibration(probe, means, [pack_real(light) for light in lights], list(range(len(seeds))))


@pytest.fixture(scope="module")
def many(probe, blank, lit, random_light):
    """Lightings enough to determine every coefficient: three channels each."""
    return calibrated(probe, blank, lit, random_light, range(40))


def error(estimate, light):
    return np.abs(estimate.lighting.coefficients - light).max() / abs(light[0, 0])


def test_with_enough_lightings_new_light_is_exact_at_the_one_view(probe, many, blank, lit, random_light):
    light = random_light(99)
    assert error(FixedEstimator(probe, many).estimate(lit(blank(), light), 0.0), light) < 5e-3


def test_it_fails_from_elsewhere(probe, many, blank, lit, random_light):
    light = random_light(99)
    estimator = FixedEstimator(probe, many)
    errors = [
        error(estimator.estimate(lit(blank((20.0 + aside, -180.0, 260.0)), light), 0.0), light)
        for aside in (0.0, 12.0, 30.0, 60.0)
    ]
    assert np.all(np.diff(errors) > 0.0)
    assert errors[-1] > 0.3


def test_estimates_are_linear_in_the_light(probe, many, blank, lit, random_light):
    estimator = FixedEstimator(probe, many)
    first, second = (random_light(seed) for seed in (50, 51))
    one, two, both = (
        estimator.estimate(lit(blank(), light), 0.0).lighting.coefficients
        for light in (first, second, 0.5 * first + 2.0 * second)
    )
    np.testing.assert_allclose(both, 0.5 * one + 2.0 * two, atol=1e-9)


def test_an_even_reflection_does_not_matter(probe, many, blank, lit, random_light):
    light = random_light(60)
    estimator = FixedEstimator(probe, many)
    dull, glossy = (
        estimator.estimate(lit(blank(), light, mirrored=mirrored, lower_face=0.0), 0.0) for mirrored in (0.0, 0.05)
    )
    np.testing.assert_allclose(glossy.lighting.coefficients, dull.lighting.coefficients, atol=1e-6)
    np.testing.assert_allclose(glossy.reflection - dull.reflection, 0.05, atol=1e-9)


def test_few_lightings_are_regularised_and_know_their_error(probe, blank, lit, random_light):
    few = calibrated(probe, blank, lit, random_light, range(5))
    estimator = FixedEstimator(probe, few)
    squares, claimed = [], []
    for seed in range(100, 130):
        light = random_light(seed)
        found = estimator.estimate(lit(blank(), light), 0.0).lighting
        squares.append(np.abs(pack_real(found.coefficients - light)) ** 2)
        claimed.append(np.diagonal(found.covariance, axis1=1, axis2=2).T)
    ratio = np.mean(np.array(squares)[:, 1:]) / np.mean(np.array(claimed)[:, 1:])
    assert 0.5 < ratio < 2.0


def test_the_order_of_lightings_does_not_matter(probe, blank, lit, random_light):
    light = lit(blank(), random_light(70))
    found = [
        FixedEstimator(probe, calibrated(probe, blank, lit, random_light, seeds)).estimate(light, 0.0)
        for seeds in ([1, 2, 3, 4], [3, 1, 4, 2])
    ]
    np.testing.assert_allclose(found[0].lighting.coefficients, found[1].lighting.coefficients, atol=1e-9)


def test_hidden_blocks_are_left_out(probe, many, blank, lit, random_light):
    light = random_light(80)
    means = lit(blank(), light)
    hidden = np.arange(0, len(means.valid), 16)
    means.valid[hidden] = False
    means.values[hidden] = 7.0
    assert error(FixedEstimator(probe, many).estimate(means, 0.0), light) < 0.02


def test_references_are_the_nearest_black_regions_that_are_seen(probe, blank):
    means = blank()
    blocks = field_blocks(probe)
    black = [number for number, block in enumerate(blocks) if block.kind in ("black_white", "black_black")]
    for number in black:
        means.values[number, 0] = number
    regions = ReferenceRegions(probe)
    assert regions.reflection(means)[black[0], 0] == black[0]
    means.valid[black[0]] = False
    others = [number for number in black if number != black[0]]
    center = np.array(blocks[black[0]].center_mm)
    nearest = min(others, key=lambda number: float(np.linalg.norm(np.array(blocks[number].center_mm) - center)))
    assert regions.reflection(means)[black[0], 0] == nearest
    means.valid[:] = False
    assert not np.any(regions.reflection(means))


def test_one_lighting_is_refused(probe, blank, lit, random_light):
    light = random_light(0)
    with pytest.raises(CalibrationError, match="2 or more"):
        fixed_calibration(probe, [lit(blank(), light)] * 2, [pack_real(light)] * 2, [0, 0])


def test_file_returns_what_was_written(tmp_path, probe, many, blank, lit, random_light):
    path = tmp_path / "sheet.fixed.npz"
    many.save(path)
    read = FixedCalibration.load(path, probe)
    light = random_light(90)
    found = [FixedEstimator(probe, c).estimate(lit(blank(), light), 0.0).lighting for c in (many, read)]
    np.testing.assert_array_equal(found[0].coefficients, found[1].coefficients)
    np.testing.assert_array_equal(found[0].covariance, found[1].covariance)


def test_other_files_and_sheets_are_refused(tmp_path, probe, many):
    path = tmp_path / "sheet.fixed.npz"
    with pytest.raises(CalibrationError, match="cannot be read"):
        FixedCalibration.load(path, probe)
    path.write_text("{}")
    with pytest.raises(CalibrationError, match="not a fixed calibration"):
        FixedCalibration.load(path, probe)
    np.savez(path.open("wb"), other=1)
    with pytest.raises(CalibrationError, match="not a fixed calibration"):
        FixedCalibration.load(path, probe)
    many.save(path)
    with pytest.raises(CalibrationError, match="another sheet"):
        FixedCalibration.load(path, design_probe(order=2))
    with pytest.raises(OutputError):
        many.save(tmp_path / "missing" / "sheet.fixed.npz")


def test_packed_light_is_what_the_estimate_unpacks(many):
    # V that is one of the lightings itself returns that lighting
    found = many.apply(many.means[:, :1], np.ones(len(many.means), bool))
    np.testing.assert_allclose(unpack_real(found[:, 0])[0], 1.0, atol=1e-3)
