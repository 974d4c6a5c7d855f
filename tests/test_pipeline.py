"""The loop's order: what is estimated is what is drawn."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import arlight
from arlight.budget import BudgetController, Rung
from arlight.effort import Effort
from arlight.estimation.shown_light import Need
from arlight.pipeline import Pipeline
from arlight.probe.layout import design_probe
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.synthesis import synthesize
from arlight.video.frame import Frame

CAMERA = default_camera((320, 240))


class MarkingRelighter:
    """Marks what it is given: a pixel of the composite for the pose, one for the light."""

    def __init__(self, need=None):
        self.calls = []
        self.efforts = []
        self.releases = 0
        self.need = need

    def release(self):
        self.releases += 1

    def render(self, frame, camera_from_probe, lighting, effort=None):
        self.calls.append((frame, camera_from_probe, lighting))
        self.efforts.append(effort)
        if camera_from_probe is None or lighting is None:
            return frame
        image = np.zeros((240, 320, 3), np.uint8)
        return Frame.from_rgb(image, frame.index, frame.time_s)


@pytest.fixture(scope="module")
def probe():
    return design_probe(1)


@pytest.fixture(scope="module")
def frames(probe):
    return film(probe)


def film(probe):
    settings = SynthesisSettings(
        camera=CAMERA, sheet_width_px=230.0, duration_s=0.16, frame_rate=Fraction(25), bounces=0, path="still"
    )
    return [synthetic.frame for synthetic in synthesize(settings, probe)]


def test_what_is_drawn_is_the_frames_own_pose_and_light(probe, frames):
    relighter = MarkingRelighter()
    pipeline = Pipeline(probe, CAMERA, relighter)
    for frame in frames:
        result = pipeline.process(frame)
        given, pose, lighting = relighter.calls[-1]
        assert given is frame
        assert pose is result.pose.camera_from_probe
        assert lighting is result.lighting
        assert lighting is not None
        assert result.composite.index == frame.index
        assert result.composite is not frame
        assert "render" in result.timings_s
        assert set(result.estimate.timings_s) < set(result.timings_s)


def test_the_halves_may_run_ahead_of_each_other(probe, frames):
    relighter, whole = MarkingRelighter(), Pipeline(probe, CAMERA)
    pipeline = Pipeline(probe, CAMERA, relighter)
    estimates = [pipeline.estimate(frame) for frame in frames]
    results = [pipeline.relight(frame, estimate) for frame, estimate in zip(frames, estimates, strict=True)]
    for frame, result, call in zip(frames, results, relighter.calls, strict=True):
        expected = whole.process(frame)
        assert call[0] is frame
        assert call[2] is result.lighting
        np.testing.assert_allclose(result.lighting.coefficients, expected.lighting.coefficients, rtol=1e-9, atol=1e-12)


def test_what_belongs_to_the_thread_that_relights_is_given_back(probe):
    relighter = MarkingRelighter()
    Pipeline(probe, CAMERA, relighter).release()
    Pipeline(probe, CAMERA).release()
    assert relighter.releases == 1


def test_without_a_relighter_the_frame_is_handed_through(probe, frames):
    result = Pipeline(probe, CAMERA).process(frames[0])
    assert result.composite is frames[0]
    assert result.pose.status == "tracked"


def test_a_frame_without_the_sheet_is_a_status_not_an_error(probe, frames):
    pipeline = Pipeline(probe, CAMERA, MarkingRelighter())
    table = Frame.from_rgb(np.full((240, 320, 3), 120, np.uint8))
    first = pipeline.process(table)
    assert first.pose.status == "lost"
    assert first.lighting is None
    assert first.composite is table
    assert pipeline.process(frames[0]).pose.status == "tracked"


def test_reset_is_as_good_as_new(probe, frames):
    used, new = Pipeline(probe, CAMERA), Pipeline(probe, CAMERA)
    for frame in frames[:2]:
        used.process(frame)
    used.reset()
    again, fresh = used.process(frames[2]), new.process(frames[2])
    assert again.lighting is not None
    assert fresh.lighting is not None
    np.testing.assert_allclose(again.lighting.coefficients, fresh.lighting.coefficients, rtol=1e-6, atol=1e-9)


def test_every_public_name_is_there():
    assert set(arlight.__all__) <= set(dir(arlight))
    for name in arlight.__all__:
        assert getattr(arlight, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        arlight.Nothing  # noqa: B018


def test_the_effort_that_a_budget_allows_reaches_both_halves(probe, frames):
    effort = Effort(order=0, supersampling=1)
    budget = BudgetController(10.0, [Rung(effort, 1.0, 1.0)])
    relighter = MarkingRelighter()
    pipeline = Pipeline(probe, CAMERA, relighter, budget=budget)
    results = [pipeline.process(frame) for frame in frames]
    assert [result.lighting.order for result in results] == [0] * len(frames)
    assert relighter.efforts == [effort] * len(frames)
    assert budget.frames_at.sum() == len(frames)
    assert budget.late == 0


def test_what_the_object_shows_decides_the_order():
    probe = design_probe(2)
    count = 2 * len(probe.frequencies) - 1
    need = Need(np.eye(count), np.diag(np.where(np.arange(count) == 0, 1.0, 1e-12)), 0.04)
    pipeline = Pipeline(probe, CAMERA, MarkingRelighter(need))
    orders = [
        pipeline.process(replace(frame, index=index, time_s=0.04 * index)).lighting.order
        for index, frame in enumerate(film(probe) * 10)
    ]
    assert orders[0] == 2
    assert orders[-1] == 1
