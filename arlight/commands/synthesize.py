"""`arlight synthesize`: a clip of a lit sheet with its truth."""

from fractions import Fraction

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from arlight.camera import Camera
from arlight.commands.interruption import INTERRUPTED_EXIT_CODE, Interruption
from arlight.commands.options.synthesize import SynthesizeOptions
from arlight.errors import ArlightError
from arlight.probe.assembly_storage import load_assembly
from arlight.probe.layout import design_probe
from arlight.probe.storage import load_probe
from arlight.synthetic.clip import write_clip
from arlight.synthetic.settings import SynthesisSettings, default_camera
from arlight.synthetic.synthesis import SyntheticFrame
from arlight.tracking.block_layout import field_blocks


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
