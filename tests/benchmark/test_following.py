"""Following a switched and a moving light."""

import numpy as np
import pytest

from arlight.benchmark.following import direction_lag, find_step
from arlight.fourier import analyse, half_plane_frequencies
from arlight.optics import Slab

FREQUENCIES = half_plane_frequencies(3)
SLAB = Slab()


def switched(frames: int, row: int) -> np.ndarray:
    rng = np.random.default_rng(2)
    before, after = rng.normal(size=(2, 5, 3)) + 1j * rng.normal(size=(2, 5, 3))
    return np.stack([before if frame < row else after for frame in range(frames)])


@pytest.mark.parametrize(("gain", "frames"), [(1.0, 1), (0.7, 2), (0.5, 4)])
def test_a_step_followed_exponentially(gain, frames):
    # after m frames the share 1 - (1 - gain)^m is followed
    true = switched(20, 8)
    estimated = true.copy()
    for frame in range(1, 20):
        estimated[frame] = estimated[frame - 1] + gain * (true[frame] - estimated[frame - 1])
    step = find_step(estimated, true)
    assert step is not None
    assert (step.row, step.frames_to_follow) == (8, frames)


def test_a_step_that_is_never_followed():
    true = switched(12, 5)
    step = find_step(np.broadcast_to(true[0], true.shape), true)
    assert step is not None
    assert step.frames_to_follow is None


def test_frames_without_an_estimate_follow_nothing():
    true = switched(12, 5)
    estimated = true.copy()
    estimated[5:7] = np.nan
    step = find_step(estimated, true)
    assert step is not None
    assert step.frames_to_follow == 3


def test_still_and_slowly_changing_light_has_no_step():
    still = np.ones((10, 5, 3), complex)
    slow = still * np.linspace(1.0, 1.5, 10)[:, None, None]
    assert find_step(still, still) is None
    assert find_step(slow, slow) is None
    assert find_step(still[:1], still[:1]) is None


def turning(azimuth_deg: np.ndarray, elevation_deg: float = 50.0) -> np.ndarray:
    polar, azimuth = np.radians(90.0 - elevation_deg), np.radians(azimuth_deg)
    directions = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.full(azimuth.shape, np.cos(polar))],
        axis=1,
    )
    plane = SLAB.light_plane(directions)
    return np.stack([analyse(np.ones((1, 3)), point[None], FREQUENCIES) for point in plane])


@pytest.mark.parametrize("behind_deg", [3.0, -2.0])
def test_a_light_that_trails_by_a_known_angle(behind_deg):
    azimuth = np.linspace(0.0, 60.0, 61)
    lag = direction_lag(turning(azimuth - behind_deg), turning(azimuth), FREQUENCIES, SLAB, np.arange(61) / 30)
    assert lag is not None
    # the angle on the sphere between two directions of one elevation
    expected = 2.0 * np.degrees(np.arcsin(np.cos(np.radians(50.0)) * np.sin(np.radians(abs(behind_deg) / 2.0))))
    assert lag[0] == pytest.approx(expected, rel=2e-3)
    # the motion at the first and last frame is a one-sided difference
    assert lag[1] == pytest.approx(np.sign(behind_deg) * expected, rel=0.01)


def test_an_error_across_the_motion_is_no_lag():
    azimuth = np.linspace(0.0, 60.0, 61)
    lag = direction_lag(turning(azimuth, 52.0), turning(azimuth), FREQUENCIES, SLAB, np.arange(61) / 30)
    assert lag is not None
    # the lobe's centroid is taken on a grid
    assert lag[0] == pytest.approx(2.0, rel=2e-3)
    assert abs(lag[1]) < 0.01


def test_a_light_that_stands_still_has_no_lag():
    still = turning(np.zeros(20))
    assert direction_lag(still, still, FREQUENCIES, SLAB, np.arange(20) / 30) is None
