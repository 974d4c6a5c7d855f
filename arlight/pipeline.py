"""The frame loop: a frame comes in, becomes a pose, becomes lighting, becomes an image."""

from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

from arlight.budget import BudgetController
from arlight.camera import Camera, Pose
from arlight.effort import Effort
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need
from arlight.lighting_tracker import BlockEstimator, FrameEstimate, LightingTracker, TrackerSettings
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.pose import ProbePose
from arlight.video.frame import Frame


class FrameRelighter(Protocol):
    """What draws a lit object into a frame, such as `arlight.Relighter`."""

    @property
    def need(self) -> Need | None:
        """What of the light the object shows; None while that is not known yet."""

    def render(
        self, frame: Frame, camera_from_probe: Pose | None, lighting: Lighting | None, effort: Effort | None = None
    ) -> Frame:
        """The frame with the lit object in it; the frame itself where pose or light is not known."""

    def release(self) -> None:
        """Give back what belongs to the thread that renders, such as an OpenGL context; called from that thread."""


@dataclass(frozen=True, slots=True)
class FrameResult:
    """What the loop made of one frame."""

    composite: Frame
    """The frame with the lit object in it; the frame itself while nothing can be drawn."""
    estimate: FrameEstimate
    """Pose and lighting of the frame."""
    timings_s: dict[str, float]
    """Seconds per stage, the estimate's stages and `render`."""

    @property
    def pose(self) -> ProbePose:
        """Where the sheet is."""
        return self.estimate.pose

    @property
    def lighting(self) -> Lighting | None:
        """The filtered lighting; None before the first estimate."""
        return self.estimate.lighting


class Pipeline:
    """Frames in, lit composites out; the same as `LightingTracker` with relighting and compositing."""

    def __init__(
        self,
        probe: Probe,
        camera: Camera,
        relighter: FrameRelighter | None = None,
        settings: TrackerSettings | None = None,
        assembly: Assembly | None = None,
        estimator: BlockEstimator | None = None,
        budget: BudgetController | None = None,
    ) -> None:
        """Prepare the loop.

        Args:
            probe: the sheet in the footage.
            camera: the camera that filmed it.
            relighter: draws the object; None leaves the frames as they are (lighting only).
            settings: choices of the estimation.
            assembly: what calibration found the printed sheet to be.
            estimator: what makes lighting of the blocks; the model of the assembled sheet by default.
            budget: holds a deadline; without it every frame gets all that the settings ask for.

        Raises:
            ProbeError: the sheet cannot be tracked.
        """
        self._tracker = LightingTracker(probe, camera, settings, assembly, estimator)
        self._relighter = relighter
        self._budget = budget
        self._need_is_known = relighter is None

    @property
    def has_deadline(self) -> bool:
        """Whether frames are to be done within a budget of time."""
        return self._budget is not None

    def process(self, frame: Frame) -> FrameResult:
        """Track the sheet, estimate its light, draw the object under that light.

        Frames are to come in order; a frame without the sheet in view is answered with the status `coasting` or
        `lost`, never with an exception.
        """
        return self.relight(frame, self.estimate(frame))

    def estimate(self, frame: Frame) -> FrameEstimate:
        """The first half of `process`: track the sheet and estimate its light; frames are to come in order."""
        if not self._need_is_known and self._relighter is not None and self._relighter.need is not None:
            self._tracker.require(self._relighter.need)
            self._need_is_known = True
        if self._budget is not None:
            if self._budget.leaves_out():
                pose = ProbePose(None, float("nan"), "left out")
                return FrameEstimate(frame.index, frame.time_s, pose, None, None)
            self._tracker.effort = self._budget.effort
        return self._tracker.update(frame)

    def relight(self, frame: Frame, estimate: FrameEstimate) -> FrameResult:
        """The second half: draw the object; from one thread, which need not be the one that estimates."""
        if estimate.pose.status == "left out":
            return FrameResult(frame, estimate, estimate.timings_s)
        started = perf_counter()
        composite = frame
        if self._relighter is not None:
            composite = self._relighter.render(
                frame, estimate.pose.camera_from_probe, estimate.lighting, estimate.effort
            )
        render_s = perf_counter() - started
        if self._budget is not None:
            self._budget.took(estimate.effort, sum(estimate.timings_s.values()), render_s)
        return FrameResult(composite, estimate, estimate.timings_s | {"render": render_s})

    def release(self) -> None:
        """Give back what belongs to the thread that relights, from that thread; it is acquired again when needed."""
        if self._relighter is not None:
            self._relighter.release()

    def reset(self) -> None:
        """Forget pose and light, as before the first frame."""
        self._tracker.reset()
