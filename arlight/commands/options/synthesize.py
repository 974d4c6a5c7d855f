"""What `arlight synthesize` takes."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import OptionalFile
from arlight.synthetic.light_script import ScriptName
from arlight.synthetic.motion import PathName
from arlight.synthetic.sensor import Sensor
from arlight.synthetic.settings import CRF


@dataclass(frozen=True)
class SynthesizeOptions:
    """Film a sheet that is not there: a clip with its truth.

    The folder gets NAME.mp4, NAME.truth.json (pose, light and exposure of every frame), probe.json and camera.json.
    Nothing that is there is replaced. Ctrl-C ends the clip after the frame in hand.
    """

    output: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("clip")
    """Folder to write to; made if it does not exist."""
    name: str | None = None
    """Name of the clip; that of its camera path by default."""
    environment: Annotated[str, tyro.conf.arg(metavar="NAME|FILE")] = "hall"
    """Captured light: the name of one that comes with arlight, or a latitude-longitude .hdr or .exr file."""
    yaw_deg: float = 0.0
    """Turn of the environment about the zenith [deg]."""
    light: ScriptName = "still"
    """still; turn: the light turns about the zenith; switch: a second light goes on; fade: it goes on slowly."""
    turn_deg_per_s: float = 10.0
    """How fast `turn` turns [deg/s]."""
    second_environment: Annotated[str | None, tyro.conf.arg(metavar="NAME|FILE")] = None
    """Light that `switch` and `fade` add."""
    second_yaw_deg: float = 0.0
    """Turn of the second environment [deg]."""
    second_gain: float = 1.0
    """Factor on the second environment."""
    path: PathName = "orbit"
    """How the camera moves."""
    tilt_deg: float | None = None
    """Camera's angle off the sheet's normal; the path's own by default [deg]."""
    sheet_width_px: float = 650.0
    """Width of the sheet in the picture [px]."""
    seconds: float = 5.0
    """Length of the clip [s]."""
    frame_rate: str = "25"
    """Frames per second, such as 25 or 30000/1001."""
    size: tuple[int, int] = (1280, 720)
    """Width and height of the picture [px]."""
    probe: OptionalFile = None
    """probe.json of the sheet; one of --order is designed by default."""
    camera: OptionalFile = None
    """camera.json of the camera that films; a phone-like one of the size asked for by default."""
    order: int = 5
    """Order of the sheet that is designed, 1 to 8."""
    assembly: OptionalFile = None
    """NAME.calibration.json of how the sheet was printed and put together; exactly as designed by default."""
    white: float = 0.6
    """Linear value of white paper under the brightest light: the exposure."""
    exposure_swing: float = 0.0
    """Automatic exposure: share by which the gain swings up and down, once over the clip."""
    white_balance_drift: float = 0.0
    """Automatic white balance: share by which red gains and blue loses until the end."""
    sensor: Sensor = field(default_factory=Sensor)
    seed: int = 0
    """Chooses noise and shake."""
    crf: int = CRF
    """Quality of H.264, 0 (lossless) to 51."""
