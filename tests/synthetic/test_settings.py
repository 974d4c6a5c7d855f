"""Settings: frame counts, the default camera, what is refused."""

from fractions import Fraction

import numpy as np
import pytest

from arlight.errors import ArlightError
from arlight.synthetic.settings import SynthesisSettings, default_camera


@pytest.mark.parametrize(
    ("duration_s", "rate", "count"),
    [(5.0, Fraction(25), 125), (1.0, Fraction(30000, 1001), 30), (0.01, Fraction(25), 1)],
)
def test_frame_count(duration_s, rate, count):
    assert SynthesisSettings(duration_s=duration_s, frame_rate=rate).frame_count == count


def test_default_camera_sees_about_sixty_degrees():
    for size in ((1280, 720), (640, 360)):
        camera = default_camera(size)
        left, right = camera.rays([[0.0, size[1] / 2], [size[0] - 1.0, size[1] / 2]])
        assert np.rad2deg(np.arctan(right[0]) - np.arctan(left[0])) == pytest.approx(60.0, abs=2.0)
        assert camera.image_size == size


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"path": "loop"}, "handheld"),
        ({"light": "strobe"}, "fade"),
        ({"duration_s": -1.0}, "positive"),
        ({"frame_rate": Fraction(0)}, "positive"),
        ({"white": 0.0}, "white"),
        ({"exposure_swing": 1.0}, "exposure_swing"),
        ({"white_balance_drift": float("nan")}, "white_balance_drift"),
        ({"bounces": -1}, "bounces"),
        ({"samples_per_side": 0}, "samples_per_side"),
        ({"sample_mm": 0.0}, "sample_mm"),
    ],
)
def test_impossible_settings_are_refused(wrong, message):
    with pytest.raises(ArlightError, match=message):
        SynthesisSettings(**wrong)


def test_exposure_is_locked_unless_it_is_asked_to_swing():
    for time_s in (0.0, 1.7, 5.0):
        np.testing.assert_array_equal(SynthesisSettings().gain(time_s), 1.0)
    swinging = SynthesisSettings(exposure_swing=0.3, duration_s=4.0)
    np.testing.assert_allclose([swinging.gain(t)[1] for t in (0.0, 1.0, 2.0, 3.0)], [1.0, 1.3, 1.0, 0.7])
