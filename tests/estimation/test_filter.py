"""Still, moving, switched and hidden light, seen through noise that is what its covariance says."""

from dataclasses import replace

import numpy as np
import pytest

from arlight.estimation.filter import LightingFilter
from arlight.estimation.lighting import Lighting
from arlight.fourier import half_plane_frequencies, pack_real, unpack_real

FREQUENCIES = half_plane_frequencies(3)
SIZE = 2 * len(FREQUENCIES) - 1
FRAME_S = 0.04


def natural(seed=0, irradiance=1.5):
    """(size, 3) packed coefficients like those of real light."""
    generator = np.random.default_rng(seed)
    order = np.repeat(np.hypot(*FREQUENCIES[1:].T), 2)[:, None]
    swing = generator.normal(size=(SIZE - 1, 1)) + 0.1 * generator.normal(size=(SIZE - 1, 3))
    return irradiance * np.concatenate([np.ones((1, 3)), 0.2 * swing / np.sqrt(order)])


def correlated(sigma, seed=1):
    """(3, size, size) covariance of noise of about sigma, the same in every frame."""
    factors = np.random.default_rng(seed).normal(size=(3, SIZE, 3 * SIZE))
    return sigma**2 * factors @ factors.swapaxes(1, 2) / (3 * SIZE)


class Source:
    """Measurements of given light with noise."""

    def __init__(self, sigma=0.02, seed=2):
        self.covariance = correlated(sigma)
        self._factor = np.linalg.cholesky(self.covariance)
        self._generator = np.random.default_rng(seed)

    def noise(self):
        return np.einsum("cij,cj->ic", self._factor, self._generator.normal(size=(3, SIZE)))

    def measure(self, truth, time_s, chi2=1.0):
        return Lighting(FREQUENCIES, unpack_real(truth + self.noise()), self.covariance, time_s, chi2)


class LastingSource(Source):
    """The same when a share of the noise's variance is new in every frame and the rest dies away in a time."""

    def __init__(self, independent, lasting_s, sigma=0.015, seed=2):
        super().__init__(sigma, seed)
        self._independent = independent
        self._kept = np.exp(-FRAME_S / lasting_s)
        self._lasting = super().noise()

    def noise(self):
        """The next frame's noise, (size, 3)."""
        self._lasting = self._kept * self._lasting + np.sqrt(1.0 - self._kept**2) * super().noise()
        return np.sqrt(self._independent) * super().noise() + np.sqrt(1.0 - self._independent) * self._lasting


def exposed(lighting, gain):
    """A light as a camera shows it whose channels have been exposed differently, gain (3,)."""
    return Lighting(
        FREQUENCIES,
        lighting.coefficients * gain,
        lighting.covariance * (gain**2)[:, None, None],
        lighting.time_s,
        lighting.chi2,
    )


def error(lighting, truth):
    return float(np.sqrt(np.mean((pack_real(lighting.coefficients) - truth) ** 2)))


def normalised_square(lighting, truth):
    """e' C^-1 e a degree of freedom, mean over the channels: 1 where error bars are honest."""
    wrong = pack_real(lighting.coefficients) - truth
    return float(np.mean([e @ np.linalg.solve(c, e) for e, c in zip(wrong.T, lighting.covariance, strict=True)]) / SIZE)


def assert_is_covariance(lighting):
    assert np.all(np.isfinite(lighting.covariance))
    np.testing.assert_allclose(lighting.covariance, lighting.covariance.swapaxes(1, 2), rtol=1e-9, atol=1e-15)
    assert np.linalg.eigvalsh(lighting.covariance).min() > 0.0


def test_there_is_nothing_before_the_first_estimate():
    filter_ = LightingFilter()
    assert filter_.update(None, 0.0) is None
    assert filter_.update(None, 0.1) is None
    first = Source().measure(natural(), 0.2)
    taken = filter_.update(first, 0.2)
    np.testing.assert_array_equal(taken.coefficients, first.coefficients)
    np.testing.assert_array_equal(taken.covariance, first.covariance)
    assert taken.time_s == 0.2


@pytest.mark.parametrize("seed", range(4))
def test_still_light_averages_as_one_over_the_root_of_frames(seed):
    filter_, source, truth = LightingFilter(), Source(seed=seed), natural(seed)
    errors = []
    for frame in range(120):
        lighting = filter_.update(source.measure(truth, frame * FRAME_S), frame * FRAME_S)
        assert_is_covariance(lighting)
        errors.append(error(lighting, truth))
        assert normalised_square(lighting, truth) < 2.0
    # sixteen frames, then the whole of a memory of at least a second
    assert errors[15] < 0.4 * errors[0]
    assert np.mean(errors[60:]) < 0.25 * errors[0]
    assert np.all(np.isfinite(errors))


def ramp(time_s, rate=0.3):
    """Light that moves steadily: from one natural light toward another."""
    return natural(3) + rate * time_s * (natural(4) - natural(3))


def test_a_steady_change_is_followed_without_lag():
    filter_, source = LightingFilter(), Source(sigma=0.004)
    speed = np.sqrt(np.mean((ramp(1.0) - ramp(0.0)) ** 2))
    for frame in range(75):
        time_s = frame * FRAME_S
        lighting = filter_.update(source.measure(ramp(time_s), time_s), time_s)
        assert_is_covariance(lighting)
        if time_s > 1.0:
            change = ramp(1.0) - ramp(0.0)
            behind = np.sum((ramp(time_s) - pack_real(lighting.coefficients)) * change) / np.sum(change**2)
            assert abs(behind) < 1.5 * FRAME_S
            assert error(lighting, ramp(time_s)) < 2.0 * FRAME_S * speed + 0.004


@pytest.mark.parametrize("frames_before", [1, 2, 10, 100])
def test_a_switched_light_is_shown_within_three_frames(frames_before):
    filter_, source = LightingFilter(), Source(sigma=0.01)
    before, after = natural(5, irradiance=1.0), natural(6, irradiance=1.6)
    for frame in range(frames_before):
        lighting = filter_.update(source.measure(before, frame * FRAME_S), frame * FRAME_S)
    assert error(lighting, before) < 0.02
    for frame in range(frames_before, frames_before + 3):
        lighting = filter_.update(source.measure(after, frame * FRAME_S), frame * FRAME_S)
    assert error(lighting, after) < 0.1 * np.sqrt(np.mean((after - before) ** 2))
    # and it settles there
    for frame in range(frames_before + 3, frames_before + 40):
        lighting = filter_.update(source.measure(after, frame * FRAME_S), frame * FRAME_S)
    assert error(lighting, after) < 0.5 * 0.01


def test_hidden_light_stays_and_grows_uncertain_up_to_natural_light():
    filter_, source, truth = LightingFilter(), Source(), natural(7)
    for frame in range(30):
        held = filter_.update(source.measure(truth, frame * FRAME_S), frame * FRAME_S)
    variance = np.einsum("cii->ci", held.covariance)
    for frame in range(30, 2000):
        lighting = filter_.update(None, frame * FRAME_S)
        grown = np.einsum("cii->ci", lighting.covariance)
        np.testing.assert_allclose(lighting.coefficients, held.coefficients, rtol=1e-9)
        # a coefficient's variance comes from its level's, too, which stops growing at another time
        assert np.all(grown >= variance * (1 - 2e-3))
        assert lighting.time_s == frame * FRAME_S
        assert np.isnan(lighting.chi2)
        variance = grown
    assert_is_covariance(lighting)
    # nothing is known after a minute, but light is not boundless
    spread = np.sqrt(variance)
    irradiance = truth[0]
    assert np.all(spread[:, 1:3] > 0.2 * irradiance[:, None])
    assert np.all(spread < 10.0 * irradiance[:, None])
    # the sheet returns: its light is taken over at once
    returned = natural(8)
    lighting = filter_.update(source.measure(returned, 81.0), 81.0)
    assert error(lighting, returned) < 0.04


def test_a_trend_is_not_carried_on_while_the_sheet_is_hidden():
    filter_, source = LightingFilter(), Source(sigma=0.004)
    for frame in range(50):
        lighting = filter_.update(source.measure(ramp(frame * FRAME_S), frame * FRAME_S), frame * FRAME_S)
    last = lighting.coefficients
    for frame in range(50, 100):
        lighting = filter_.update(None, frame * FRAME_S)
    step = np.abs(unpack_real(ramp(FRAME_S) - ramp(0.0)))
    assert np.all(np.abs(lighting.coefficients - last) <= 2.0 * step + 0.004)


@pytest.mark.parametrize("light", [lambda _: natural(3), ramp], ids=["still", "moving"])
def test_half_the_frames_give_about_the_same(light):
    full, half, source = LightingFilter(), LightingFilter(), Source(sigma=0.01)
    for frame in range(120):
        time_s = frame * FRAME_S / 2
        measured = source.measure(light(time_s), time_s)
        at_full = full.update(measured, time_s)
        if frame % 2 == 0:
            at_half = half.update(measured, time_s)
            if time_s > 1.0:
                assert error(at_half, pack_real(at_full.coefficients)) < 0.01
                assert error(at_half, light(time_s)) < 0.01


def test_irregular_times_are_taken_as_they_are():
    filter_, source = LightingFilter(), Source(sigma=0.004)
    times = np.cumsum(np.random.default_rng(9).choice([0.005, 0.02, 0.04, 0.15], 80))
    for time_s in times:
        lighting = filter_.update(source.measure(ramp(time_s), time_s), time_s)
        assert_is_covariance(lighting)
    # at a constant rate per frame instead of per second the trend would be off by most of it
    assert error(lighting, ramp(times[-1])) < 0.01


def test_times_that_stand_still_or_run_backwards_do_no_harm():
    filter_, source, truth = LightingFilter(), Source(), natural(10)
    for time_s in [0.0, 0.0, 0.04, 0.04, 0.04, 0.02, -5.0, -5.0, 0.1, 0.14, 0.14]:
        lighting = filter_.update(source.measure(truth, time_s), time_s)
        assert_is_covariance(lighting)
    assert error(lighting, truth) < 0.02
    assert filter_.update(None, -100.0) is not None


def test_repeated_times_average_like_any_other_frames():
    filter_, source, truth = LightingFilter(), Source(), natural(11)
    first = error(filter_.update(source.measure(truth, 0.0), 0.0), truth)
    for _ in range(24):
        lighting = filter_.update(source.measure(truth, 0.0), 0.0)
    assert error(lighting, truth) < 0.35 * first


def test_a_brighter_scene_is_filtered_alike():
    dim, bright, gain = LightingFilter(), LightingFilter(), 20.0
    source = Source(sigma=0.02)
    for frame in range(60):
        time_s = frame * FRAME_S
        truth = natural(12) if frame < 20 else ramp(time_s)
        measured = None if 40 <= frame < 45 else source.measure(truth, time_s)
        scaled = measured and Lighting(
            FREQUENCIES, gain * measured.coefficients, gain**2 * measured.covariance, time_s, measured.chi2
        )
        one, other = dim.update(measured, time_s), bright.update(scaled, time_s)
        np.testing.assert_allclose(other.coefficients, gain * one.coefficients, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(other.covariance, gain**2 * one.covariance, rtol=1e-6, atol=1e-12)


def test_reset_is_as_good_as_new():
    used, new = LightingFilter(), LightingFilter()
    source = Source()
    for frame in range(30):
        used.update(source.measure(ramp(3.0 * frame * FRAME_S), frame * FRAME_S), frame * FRAME_S)
    used.reset()
    assert used.update(None, 5.0) is None
    for frame in range(10):
        measured = source.measure(natural(13), frame * FRAME_S)
        one, other = used.update(measured, frame * FRAME_S), new.update(measured, frame * FRAME_S)
        np.testing.assert_allclose(one.coefficients, other.coefficients, rtol=1e-12)
        np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-12)


LASTING_S = [0.3, 1.0, 1e6]
SHARES = [0.0, 0.1, 0.4, 0.8]


def normalised_squares(light, independent, lasting_s, frames=70, seeds=3):
    """Mean normalised error squared after the first second, over several runs."""
    found = []
    for seed in range(seeds):
        filter_, source = LightingFilter(), LastingSource(independent, lasting_s, seed=seed)
        for frame in range(frames):
            time_s = frame * FRAME_S
            lighting = filter_.update(source.measure(light(time_s), time_s), time_s)
            if time_s > 1.0:
                found.append(normalised_square(lighting, light(time_s)))
    return float(np.mean(found))


@pytest.mark.parametrize(("independent", "lasting_s"), [*((i, t) for i in SHARES for t in LASTING_S), (1.0, 1.0)])
def test_error_bars_are_honest_however_long_errors_last(independent, lasting_s):
    assert 0.8 < normalised_squares(lambda _: natural(3), independent, lasting_s) < 1.3


@pytest.mark.parametrize(("independent", "lasting_s"), [(0.1, 1.0), (0.4, 1e6), (1.0, 1.0)])
def test_error_bars_of_moving_light_are_honest(independent, lasting_s):
    assert 0.8 < normalised_squares(ramp, independent, lasting_s) < 1.5


def test_errors_that_last_are_not_averaged_away():
    same, new = (LightingFilter() for _ in range(2))
    lasting, fresh = LastingSource(0.0, 1e6), LastingSource(1.0, 1.0)
    for frame in range(60):
        time_s = frame * FRAME_S
        one, other = (f.update(s.measure(natural(3), time_s), time_s) for f, s in ((same, lasting), (new, fresh)))
    np.testing.assert_allclose(one.stddev[1:], np.sqrt(lasting.covariance[:, 1::2, 1::2].diagonal(axis1=1, axis2=2).T
        + lasting.covariance[:, 2::2, 2::2].diagonal(axis1=1, axis2=2).T), rtol=0.15)  # fmt: skip
    assert np.all(other.stddev[1:] < 0.3 * one.stddev[1:])


def exposure(time_s):
    """30 % up and down within 2.5 s, and a white balance that drifts."""
    return (1.0 + 0.3 * np.sin(2.0 * np.pi * time_s / 2.5)) * np.array([1.0 + 0.02 * time_s, 1.0, 1.0 - 0.03 * time_s])


def stepped(time_s):
    """Two thirds of a stop at once, and back."""
    return np.full(3, 1.6 if 1.2 < time_s < 2.4 else 1.0)


@pytest.mark.parametrize("gain", [exposure, stepped])
@pytest.mark.parametrize(("independent", "lasting_s"), [(0.3, 0.5), (1.0, 1.0)])
def test_an_automatic_exposure_costs_little(gain, independent, lasting_s):
    errors, levels = [], []
    for curve in (lambda _: np.ones(3), gain):
        filter_, source = LightingFilter(), LastingSource(independent, lasting_s, sigma=0.006)
        wrong = []
        for frame in range(100):
            time_s = frame * FRAME_S
            measured = exposed(source.measure(natural(3), time_s), curve(time_s))
            lighting = filter_.update(measured, time_s)
            if time_s > 1.0:
                wrong.append((pack_real(lighting.coefficients) / curve(time_s) - natural(3)) ** 2)
        errors.append(np.sqrt(np.mean(np.array(wrong)[:, 1:])))
        levels.append(np.sqrt(np.mean(np.array(wrong)[:, 0])))
    assert errors[1] < 1.5 * errors[0]
    # an exposure that may change cannot be averaged: one frame's error is left of the level
    assert levels[1] < 1.2 * 0.006


def test_a_steady_exposure_is_averaged():
    filter_, source = LightingFilter(), Source(sigma=0.01)
    levels = []
    for frame in range(200):
        lighting = filter_.update(source.measure(natural(3), frame * FRAME_S), frame * FRAME_S)
        levels.append(lighting.coefficients[0].real - 1.5)
    assert np.sqrt(np.mean(np.square(levels[50:]))) < 0.35 * 0.01


def test_a_known_exposure_changes_nothing():
    plain, exposed_filter, source = LightingFilter(), LightingFilter(), Source(sigma=0.01)
    for frame in range(60):
        time_s = frame * FRAME_S
        gain, measured = exposure(time_s), source.measure(ramp(time_s), time_s)
        one = plain.update(measured, time_s)
        other = exposed_filter.update(exposed(measured, gain), time_s, gain)
        np.testing.assert_allclose(other.coefficients, one.coefficients * gain, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(other.covariance, exposed(one, gain).covariance, rtol=1e-5, atol=1e-10)


def test_a_frame_that_was_left_out_is_predicted_with_the_trend():
    left_out, hidden, source = LightingFilter(), LightingFilter(), Source(sigma=0.002)
    for frame in range(50):
        measured = source.measure(ramp(frame * FRAME_S), frame * FRAME_S)
        for filter_ in (left_out, hidden):
            filter_.update(measured, frame * FRAME_S)
    later = 51 * FRAME_S
    predicted, kept = left_out.update(None, later, hidden=False), hidden.update(None, later)
    assert error(predicted, ramp(later)) < 0.5 * error(kept, ramp(later))
    # and what follows is taken in as ever
    measured = source.measure(ramp(later + FRAME_S), later + FRAME_S)
    assert error(left_out.update(measured, later + FRAME_S), ramp(later + FRAME_S)) < 0.005


def test_what_was_told_stays_as_it_was():
    filter_, source = LightingFilter(), Source()
    told = [filter_.update(source.measure(natural(3), frame * FRAME_S), frame * FRAME_S) for frame in range(5)]
    copies = [(light.coefficients.copy(), light.covariance.copy()) for light in told]
    for frame in range(5, 20):
        filter_.update(source.measure(natural(4), frame * FRAME_S), frame * FRAME_S)
    for light, (coefficients, covariance) in zip(told, copies, strict=True):
        np.testing.assert_array_equal(light.coefficients, coefficients)
        np.testing.assert_array_equal(light.covariance, covariance)


def test_memory_laid_out_in_another_way_is_read_all_the_same():
    filters, source = (LightingFilter(), LightingFilter()), Source()
    for frame in range(6):
        one = source.measure(natural(3), frame * FRAME_S)
        turned = Lighting(
            FREQUENCIES, np.asfortranarray(one.coefficients), one.covariance.transpose(0, 2, 1), one.time_s, 1.0
        )
        lights = [f.update(light, one.time_s) for f, light in zip(filters, (one, turned), strict=True)]
        np.testing.assert_allclose(lights[1].coefficients, lights[0].coefficients, rtol=1e-9)


def filtered(orders):
    """A filter's lightings where the frames are measured up to such orders, one after the other."""
    filter_, source = LightingFilter(), Source()
    times = np.arange(len(orders)) * FRAME_S
    frames = [source.measure(natural(3), time_s).truncated(order) for order, time_s in zip(orders, times, strict=True)]
    return [filter_.update(frame, time_s) for frame, time_s in zip(frames, times, strict=True)]


def test_orders_that_are_measured_no_longer_leave_the_others_as_they_were():
    cut = filtered([3] * 20 + [1] * 20)
    low = filtered([1] * 40)[-1]
    assert [light.order for light in cut] == [3] * 20 + [1] * 20
    # what is left differs, within the error bars, by what the others told through the errors' correlations
    assert np.all(np.abs(cut[-1].coefficients - low.coefficients) < low.stddev)
    np.testing.assert_allclose(cut[-1].stddev, low.stddev, rtol=0.25)


def test_orders_that_are_measured_again_begin_with_the_frame_and_are_averaged():
    lights = filtered([1] * 20 + [3] * 40)
    fresh = filtered([3] * 60)
    assert [light.order for light in lights[18:22]] == [1, 1, 3, 3]
    np.testing.assert_allclose(lights[20].coefficients[:3], fresh[20].coefficients[:3], atol=3 * fresh[20].stddev.max())
    high = slice(3, None)
    truth = unpack_real(natural(3))[high]
    first, last = (
        np.sqrt(np.mean(np.abs(light.coefficients[high] - truth) ** 2)) for light in (lights[20], lights[-1])
    )
    assert last < 0.5 * first


def test_error_bars_stay_a_covariance_when_orders_come_back_with_larger_errors():
    filter_, fine, coarse = LightingFilter(), Source(sigma=0.002), Source(sigma=0.02)
    coarse.covariance = correlated(0.02, seed=5) * 0.1
    # errors that all have in common
    coarse.covariance += 0.02**2 * np.ones((SIZE, SIZE))
    for frame in range(40):
        measured = fine.measure(natural(3), frame * FRAME_S)
        filter_.update(measured.truncated(1), frame * FRAME_S)
    for frame in range(40, 50):
        measured = replace(fine.measure(natural(3), frame * FRAME_S), covariance=coarse.covariance)
        assert_is_covariance(filter_.update(measured, frame * FRAME_S))


def test_an_estimate_whose_parts_do_not_fit_is_refused():
    filter_, source = LightingFilter(), Source()
    measured = source.measure(natural(3), 0.0)
    filter_.update(measured, 0.0)
    with pytest.raises(ValueError, match="expected"):
        filter_.update(replace(measured, covariance=measured.covariance[:, 1:, 1:]), 0.1)


def test_level_zero_alone_is_filtered_too():
    filter_, source = LightingFilter(), Source(sigma=0.02)
    for frame in range(60):
        measured = source.measure(natural(3), frame * FRAME_S).truncated(0)
        lighting = filter_.update(measured, frame * FRAME_S)
    assert_is_covariance(lighting)
    assert np.abs(lighting.coefficients[0].real - 1.5).max() < 0.4 * 0.02
