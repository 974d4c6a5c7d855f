"""What is filmed for the benchmark: scenes, and the cameras that film them."""

from dataclasses import dataclass, field, replace
from fractions import Fraction

from arlight.benchmark.speed.skies import sky
from arlight.probe.design import Probe
from arlight.probe.layout import design_probe
from arlight.synthetic.light_script import LightScript, ScriptName, exposure_for
from arlight.synthetic.motion import CameraMotion, PathName
from arlight.synthetic.sensor import Sensor

FRAME_RATE = Fraction(25)
APRILTAG_DICTIONARY = "DICT_APRILTAG_36h11"
HEADLINE = "720p order 5"
"""The workload that the published figures are about."""
LARGE = "1080p order 5"

_TURN_DEG_PER_S = 12.0
_KEY_DEG = 12.0
_WHITE = 0.6
_PATH_S = 5.0
_FILMED_FROM_S = 1.0
_SWITCHED_ON, _SWITCHED_S = "studio", 1.23


@dataclass(frozen=True, slots=True)
class Scene:
    """A sheet under a light, seen from a path, as light that reaches the sensor."""

    order: int = 5
    """Order of the sheet."""
    size: tuple[int, int] = (1280, 720)
    """Width and height of the picture [px]."""
    path: PathName = "orbit"
    """How the camera moves."""
    script: ScriptName = "still"
    """What the light does: it stays, turns about the zenith, or another one goes on at `_SWITCHED_S`."""
    environment: str = "hall"
    """Light, as `sky` names it."""
    sheet_width_px: float = 650.0
    """Width of the sheet in the picture [px]."""
    april_tags: bool = False
    """Fiducials are AprilTags 36h11 instead of the sheet's own."""

    @property
    def probe(self) -> Probe:
        """The sheet."""
        probe = design_probe(self.order)
        return replace(probe, dictionary=APRILTAG_DICTIONARY) if self.april_tags else probe

    @property
    def light(self) -> LightScript:
        """The light over time, exposed."""
        captured = LightScript(
            sky(self.environment),
            self.script,
            turn_deg_per_s=_TURN_DEG_PER_S,
            second=sky(_SWITCHED_ON) if self.script == "switch" else None,
            change_s=_SWITCHED_S,
            key_deg=_KEY_DEG,
        )
        return captured.scaled(exposure_for(captured, self.probe.paper_reflectance, _WHITE))

    @property
    def motion(self) -> CameraMotion:
        """The camera's path."""
        return CameraMotion(self.path, self.sheet_width_px, duration_s=_PATH_S)

    @property
    def still(self) -> bool:
        """Whether all its pictures are one."""
        return self.path == "still" and self.script == "still"


@dataclass(frozen=True, slots=True)
class Workload:
    """A clip: a scene, the sensor that records it and the compression."""

    name: str
    """In words; the same name always means the same frames."""
    scene: Scene = field(default_factory=Scene)
    """What is filmed."""
    sensor: Sensor = field(default_factory=Sensor)
    """Blur and noise."""
    crf: int = 18
    """Quality of H.264; 0 is lossless."""
    half_cycle: int = 12
    """Pictures from one turning point of the cycle to the other."""

    @property
    def cycle(self) -> int:
        """Frames after which the clip is where it began."""
        return 2 * self.half_cycle

    def time_s(self, index: int) -> float:
        """When on the scene's path a frame of the cycle is, there and back [s]."""
        step = index % self.cycle
        return _FILMED_FROM_S + float(min(step, self.cycle - step) / FRAME_RATE)


_NOISY = Sensor(read_noise=0.006, gain=4.8e-4)
"""Four times the usual noise."""
_BLURRED = Sensor(blur_px=1.6)

QUICK = (
    Workload(HEADLINE),
    Workload("720p order 3, still camera", Scene(order=3, path="still")),
    Workload(LARGE, Scene(size=(1920, 1080), path="still", sheet_width_px=975.0), half_cycle=6),
)
"""The subset of `--quick`."""

FULL = (
    *QUICK,
    *(Workload(f"720p order {order}", Scene(order=order)) for order in (1, 2, 3, 4)),
    Workload("720p order 5, still camera", Scene(path="still")),
    Workload("720p order 5, turning light", Scene(script="turn")),
    Workload("720p order 5, switched light", Scene(script="switch")),
    Workload("720p order 5, still camera, turning light", Scene(path="still", script="turn")),
    Workload("720p order 5, blurred", sensor=_BLURRED),
    Workload("720p order 5, noisy", sensor=_NOISY),
    Workload("720p order 5, crf 28", crf=28),
    *(Workload(f"720p order 5, {name}", Scene(environment=name)) for name in ("apartment", "bridge", "studio")),
    # light so soft that a lower order suffices
    *(Workload(f"720p order 5, {name}", Scene(environment=name)) for name in ("overcast", "haze")),
)
"""Every workload that stages are timed on."""

APRIL_TAGS = Workload("720p AprilTags", Scene(april_tags=True))
"""The scene of the headline with a sheet that pupil-apriltags can find."""


def still_workload(size: tuple[int, int], sheet_width_px: float) -> Workload:
    """A still camera over a sheet of any size in a picture of any size, for how cost grows."""
    scene = Scene(path="still", size=size, sheet_width_px=sheet_width_px)
    return Workload(f"{size[1]}p, sheet {sheet_width_px:g} px", scene, half_cycle=6)
