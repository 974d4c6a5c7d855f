"""`arlight synthesize`: a clip of a lit sheet with its truth."""

from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from arlight.camera import Camera
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE, Interruption
from arlight.commands.options import OptionalFile
from arlight.errors import ArlightError
from arlight.probe.assembly_storage import load_assembly
from arlight.probe.layout import design_probe
from arlight.probe.storage import load_probe
from arlight.synthetic.clip import CRF, write_clip
from arlight.synthetic.light_script import ScriptName
from arlight.synthetic.motion import PathName
from arlight.synthetic.sensor import Sensor
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.synthesis import SyntheticFrame
from arlight.tracking.block_layout import field_blocks


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


def run(options: SynthesizeOptions) -> int:
    """Write the clip; returns the exit status.

    Raises:
        ArlightError: the light, the sheet or the camera cannot be used, or the clip cannot be written.
    """
    settings = _settings(options)
    probe = design_probe(options.order) if options.probe is None else load_probe(options.probe)
    assembly = None if options.assembly is None else load_assembly(options.assembly, len(field_blocks(probe)))
    name = options.name or options.path
    with Interruption() as interruption, Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(escape(name), total=settings.frame_count)

        def watch(_frame: SyntheticFrame) -> None:
            progress.advance(task)
            if interruption.requested:
                raise KeyboardInterrupt

        try:
            write_clip(options.output, name, settings, probe, assembly=assembly, crf=options.crf, watch=watch)
        except KeyboardInterrupt:
            return INTERRUPTED_EXIT_CODE
    Console(soft_wrap=True, highlight=False, markup=False).print(f"{options.output / name}.mp4")
    return 0


def _settings(options: SynthesizeOptions) -> SynthesisSettings:
    return SynthesisSettings(
        environment=options.environment,
        yaw_deg=options.yaw_deg,
        light=options.light,
        turn_deg_per_s=options.turn_deg_per_s,
        second_environment=options.second_environment,
        second_yaw_deg=options.second_yaw_deg,
        second_gain=options.second_gain,
        path=options.path,
        tilt_deg=options.tilt_deg,
        sheet_width_px=options.sheet_width_px,
        duration_s=options.seconds,
        frame_rate=_rate(options.frame_rate),
        camera=default_camera(options.size) if options.camera is None else Camera.load(options.camera),
        white=options.white,
        exposure_swing=options.exposure_swing,
        white_balance_drift=options.white_balance_drift,
        sensor=options.sensor,
        seed=options.seed,
    )


def _rate(text: str) -> Fraction:
    try:
        return Fraction(text)
    except (ValueError, ZeroDivisionError) as error:
        raise ArlightError(f"--frame-rate {text}: expected frames per second such as 25 or 30000/1001") from error
