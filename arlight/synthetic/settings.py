"""What a synthetic clip shows and how it is filmed."""

from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera
from arlight.errors import ArlightError
from arlight.synthetic.light_script import SCRIPTS, ScriptName
from arlight.synthetic.motion import PATHS, PathName
from arlight.synthetic.sensor import Sensor

DEFAULT_FRAME_RATE = Fraction(25)
CRF = 16
"""Quality of a clip's H.264, 0 (lossless) to 51."""


@dataclass(frozen=True, slots=True)
class SynthesisSettings:
    """A camera on a path over a lit sheet."""

    environment: str = "hall"
    """Captured light: a .hdr or .exr file (latitude-longitude), or the name of one that comes with arlight."""
    yaw_deg: float = 0.0
    """Turn of the environment about the zenith, counter-clockwise from above [deg]."""
    light: ScriptName = "still"
    """`still`; `turn`: the light turns about the zenith; `switch`: a second light goes on; `fade`: slowly."""
    turn_deg_per_s: float = 10.0
    """Rate of `turn` [deg/s]."""
    second_environment: str | None = None
    """Light that `switch` and `fade` add to the first."""
    second_yaw_deg: float = 0.0
    """Turn of the second environment about the zenith [deg]."""
    second_gain: float = 1.0
    """Factor on the second environment's radiance, relative to the first's."""
    change_s: float | None = None
    """When the second light begins to go on; the middle of the clip by default [s]."""
    fade_s: float = 1.0
    """How long `fade` takes [s]."""
    path: PathName = "orbit"
    """`still`, `orbit`, `low`, `approach` or `handheld`."""
    tilt_deg: float | None = None
    """Camera's angle off the normal around which the path goes; the path's own by default [deg]."""
    sheet_width_px: float = 650.0
    """Width of the sheet in the picture [px]; less where the sheet would leave the picture."""
    duration_s: float = 5.0
    """Length of the clip [s]."""
    frame_rate: Fraction = DEFAULT_FRAME_RATE
    """Frames per second, such as 25 or 30000/1001."""
    camera: Camera | None = None
    """Camera that films; 1280x720 with a slight lens distortion by default."""
    white: float = 0.6
    """Linear value of white paper in its brightest channel under the brightest light; sets the exposure."""
    exposure_swing: float = 0.0
    """Automatic exposure: by which share the gain swings up and down, once over the clip; 0 for a locked exposure."""
    white_balance_drift: float = 0.0
    """Automatic white balance: by which share red gains and blue loses until the clip's end; 0 for a locked one."""
    bounces: int = 3
    """How often light between paper and glass is followed; 0 for single scattering."""
    sample_mm: float = 0.13
    """Largest distance of samples on the sheet, well below the finest stripe; 0.3 is twice as fast [mm]."""
    samples_per_side: int = 3
    """Fewest samples along a pixel's side."""
    sensor: Sensor = field(default_factory=Sensor)
    """Blur, vignetting and noise."""
    seed: int = 0
    """Chooses noise and shake; the same settings give the same clip."""

    def __post_init__(self) -> None:
        if self.path not in PATHS:
            raise ArlightError(f"unknown camera path {self.path!r}; choose one of {', '.join(PATHS)}")
        if self.light not in SCRIPTS:
            raise ArlightError(f"unknown light script {self.light!r}; choose one of {', '.join(SCRIPTS)}")
        if not (np.isfinite(self.duration_s) and self.duration_s > 0.0 and self.frame_rate > 0):
            raise ArlightError(
                f"duration_s and frame_rate must be positive, found {self.duration_s} s and {self.frame_rate}"
            )
        if not self.white > 0.0:
            raise ArlightError(f"white must be above 0, found {self.white}")
        for name in ("exposure_swing", "white_balance_drift"):
            if not -1.0 < getattr(self, name) < 1.0:
                raise ArlightError(f"{name} must lie between -1 and 1, found {getattr(self, name)}")
        if not 0 <= self.bounces <= 20:
            raise ArlightError(f"bounces must lie between 0 and 20, found {self.bounces}")
        if not 1 <= self.samples_per_side <= 16:
            raise ArlightError(f"samples_per_side must lie between 1 and 16, found {self.samples_per_side}")
        if not self.sample_mm > 0.0:
            raise ArlightError(f"sample_mm must be a positive distance in millimetres, found {self.sample_mm}")

    @property
    def frame_count(self) -> int:
        """Frames of the clip, at least one."""
        return max(1, round(self.duration_s * self.frame_rate))

    def gain(self, time_s: float) -> NDArray[np.float64]:
        """(3,) factor on what the camera records at a time [s], from automatic exposure and white balance."""
        share = time_s / self.duration_s
        balance = 1.0 + self.white_balance_drift * share * np.array([1.0, 0.0, -1.0])
        return np.asarray((1.0 + self.exposure_swing * np.sin(2.0 * np.pi * share)) * balance, float)

    @property
    def filming_camera(self) -> Camera:
        """The camera, or the default one."""
        return self.camera or default_camera()


def default_camera(image_size: tuple[int, int] = (1280, 720)) -> Camera:
    """A phone-like camera: 60 degrees across, principal point off the centre, a slight barrel distortion.

    Args:
        image_size: (width, height) [px].
    """
    width, height = image_size
    focal = 1100.0 / 1280.0 * width
    matrix = [[focal, 0.0, (width - 1) / 2 + 0.004 * width], [0.0, focal, (height - 1) / 2 - 0.003 * width], [0, 0, 1]]
    return Camera(image_size, np.array(matrix), np.array([0.05, -0.11, 0.0004, -0.0003, 0.03]))
