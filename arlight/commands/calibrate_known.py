"""`arlight calibrate known`: the assembled sheet from frames under known lighting."""

from itertools import islice
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from threadpoolctl import threadpool_limits

from arlight.calibration.known_lighting.calibration import KnownLightingCalibration, calibrate_known
from arlight.calibration.known_lighting.fixed_matrix import FixedResult, calibrate_fixed
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.layers.view_measurement import SeenSheet, find_sheet, varied
from arlight.camera import Camera
from arlight.commands.footage import sheet_and_camera
from arlight.commands.options.calibrate_known import CalibrateKnownOptions
from arlight.commands.outputs import Output, prepare_outputs
from arlight.environment import Environment
from arlight.errors import ArlightError, CalibrationError, CameraError
from arlight.probe.assembly_storage import load_assembly, load_vignetting, save_assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader

_SEARCHED = 60
"""Frames of a clip that are looked at, spread over it."""


def run(options: CalibrateKnownOptions) -> int:
    """Calibrate; returns the exit status.

    Raises:
        ArlightError: something the user can mend, in the frames, the environments, the sheet or an output.
    """
    _check_lists(options)
    probe, camera, notes = sheet_and_camera(options.frames[0], options.footage)
    output = _prepare(options)
    for note in notes:
        _print(note)
    lights, numbers = _lights(options, probe)
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            seen = _find(options, numbers, probe, camera)
            report = _calibrate(options, seen, lights, probe, camera, output)
    except (ArlightError, KeyboardInterrupt):
        output.discard()
        raise
    for item in report:
        _print(item)
    _print(str(output.keep()))
    return 0


def _check_lists(options: CalibrateKnownOptions) -> None:
    count = len(options.frames)
    for name, found in (
        ("--environments", len(options.environments)),
        ("--yaws", len(options.yaws)),
        ("--exposures", len(options.exposures)),
    ):
        if found != count and (found or name == "--environments"):
            raise CalibrationError(
                f"{name}: {found} for {count} --frames; give one for each clip or picture, in the same order (the same "
                "environment again where two of them show the same light)"
            )
    if not count:
        raise CalibrationError("--frames: none given; calibration needs two or more lightings")
    for name, values in (("--yaws", options.yaws), ("--exposures", options.exposures)):
        if not np.all(np.isfinite(values)):
            raise CalibrationError(f"{name}: expected finite numbers, found {' '.join(map(str, values))}")
    if options.views < 1 or any(value <= 0.0 for value in options.exposures):
        raise CalibrationError("--views must be 1 or more, and --exposures above 0")


def _prepare(options: CalibrateKnownOptions) -> Output:
    default = "sheet.fixed.npz" if options.estimator == "fixed" else "sheet.calibration.json"
    inputs = [*options.frames, *options.environments, options.calibration, options.footage.probe]
    return prepare_outputs({"--output": options.output or Path(default)}, [*inputs, options.footage.camera])["--output"]


def _lights(options: CalibrateKnownOptions, probe: Probe) -> tuple[list[KnownLight], list[int]]:
    """The distinct lights, and the number of each entry's."""
    count = len(options.frames)
    yaws, exposures = options.yaws or (0.0,) * count, options.exposures or (1.0,) * count
    keys = list(zip(options.environments, yaws, exposures, strict=True))
    distinct = list(dict.fromkeys(keys))
    lights = []
    for path, yaw, exposure in distinct:
        environment = Environment.load(path).rotated(float(np.deg2rad(yaw))).scaled(exposure)
        frames = [frame.name for frame, key in zip(options.frames, keys, strict=True) if key == (path, yaw, exposure)]
        lights.append(KnownLight(f"{', '.join(frames)} ({path.name})", environment, probe.refractive_index))
    return lights, [distinct.index(key) for key in keys]


def _find(options: CalibrateKnownOptions, numbers: list[int], probe: Probe, camera: Camera) -> list[SeenSheet]:
    seen: list[SeenSheet] = []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        for path, number in zip(progress.track(options.frames, description="track"), numbers, strict=True):
            own = find_sheet(_spread(path, camera), probe, camera, number)
            if not own:
                raise CalibrationError(
                    f"{path}: does not show the sheet; give frames in which the whole sheet is sharp and its markers "
                    "are at least 15 pixels wide"
                )
            seen += varied(own, probe, options.views)
    return seen


def _spread(path: Path, camera: Camera) -> list[Frame]:
    with VideoReader(path) as reader:
        if reader.size != camera.image_size:
            raise CameraError(
                f"{path}: its pictures are {reader.size[0]}x{reader.size[1]}, the camera's "
                f"{camera.image_size[0]}x{camera.image_size[1]}; all frames must be of one camera (--camera FILE)"
            )
        stride = max(1, -(-(reader.frame_count or 1) // _SEARCHED))
        return list(islice(reader, 0, stride * _SEARCHED, stride))


def _calibrate(
    options: CalibrateKnownOptions, seen: list[SeenSheet], lights: list[KnownLight], probe: Probe, camera: Camera,
    output: Output,
) -> list[Table | str]:  # fmt: skip
    """Calibrate and write; returns what to print."""
    if options.estimator == "fixed":
        fixed = calibrate_fixed(seen, lights, probe, camera)
        fixed.calibration.save(output.growing)
        return _fixed_report(fixed, len(lights), probe)
    start, vignetting = None, (0.0, 0.0, 0.0)
    if options.calibration is not None:
        start = load_assembly(options.calibration, len(field_blocks(probe)))
        vignetting = load_vignetting(options.calibration)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("calibrate", total=None)
        result = calibrate_known(
            seen, lights, probe, camera, start, vignetting, options.relative,
            progress=lambda done, total: progress.update(task, completed=done, total=total),
        )  # fmt: skip
    save_assembly(result.assembly, output.growing, result.stddev, result.vignetting)
    return _layers_report(result, probe)


def _layers_report(result: KnownLightingCalibration, probe: Probe) -> list[Table | str]:
    layers = Table(title=f"the sheet as it is, from {result.views} frames under {len(result.errors)} lightings")
    for column in ("", "found", "standard deviation"):
        layers.add_column(column, justify="left" if not column else "right")
    for name, value in result.values.items():
        layers.add_row(name, f"{value:.4f}", f"{result.stddev[name]:.4f}")
    errors = _order_table("error relative to |L_0| of each lighting, by a calibration from the others", probe)
    for error in result.errors:
        errors.add_row(error.name, *map(_percent, error.orders))
    lines = [
        f"condition number of the {len(result.errors)} lightings: {result.condition:.1f}",
        f"distrusted blocks: {len(result.distrusted) or 'none'}",
    ]
    return [layers, errors, *lines, *(f"  {block.id}: {'; '.join(block.reasons)}" for block in result.distrusted)]


def _fixed_report(result: FixedResult, lightings: int, probe: Probe) -> list[Table | str]:
    size = 2 * len(probe.frequencies) - 1
    lines: list[Table | str] = [
        f"L = MV from {lightings} lightings (x 3 channels) for {size} coefficients; condition number "
        f"{result.condition:.1f}"
    ]
    if not result.offsets:
        return [*lines, "too few lightings to tell the error by leaving one out"]
    table = _order_table("error relative to |L_0| by the angle beside the viewpoint, from the other lightings", probe)
    for row in result.offsets:
        table.add_row(f"{row.offset_deg:g} deg ({row.frames} frames)", *map(_percent, row.orders))
    return [*lines, table]


def _order_table(title: str, probe: Probe) -> Table:
    table = Table(title=title)
    table.add_column("")
    for order in range(probe.order + 1):
        table.add_column(f"order {order}", justify="right")
    return table


def _percent(value: float) -> str:
    return f"{100.0 * value:.2f} %"


def _print(content: Table | str) -> None:
    Console(soft_wrap=True, highlight=False, markup=False).print(content)
