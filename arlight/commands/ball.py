"""`arlight ball`: photographs of a mirrored ball beside the sheet become an environment and its coefficients."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from rich.console import Console
from rich.progress import Progress

from arlight.calibration.ball.ball_capture import CapturedBall, CaptureSettings, capture_ball
from arlight.calibration.ball.ball_outline import BallError
from arlight.calibration.ball.environment_file import SUFFIXES, save_coefficients, save_environment
from arlight.calibration.ball.mirror_ball import BallLight, MapGrid, merge_views
from arlight.calibration.ball.photographs import Photograph, PhotographError, load_photographs
from arlight.camera import Camera, Pose
from arlight.commands.options.ball import BallOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.environment import Environment
from arlight.errors import ArlightError, CameraError, OutputError, ProbeError
from arlight.probe.design import Probe
from arlight.probe.storage import load_probe
from arlight.video.sidecars import find_sidecar


def run(options: BallOptions) -> int:
    """Write the environment and its coefficients; returns the exit status.

    Raises:
        ArlightError: the pictures, the probe or the camera cannot be used, or an output cannot be written.
    """
    probe_path, camera_path = _sidecar(options, "probe"), _sidecar(options, "camera")
    probe, camera = load_probe(probe_path), Camera.load(camera_path)
    MapGrid(options.rows)
    outputs = _prepare(options, [probe_path, camera_path])
    views = _views(options, load_photographs(list(options.pictures), options.exposures))
    reference = _reference(options, views)
    captured, light = _measure(options, views, probe, camera, reference)
    try:
        save_environment(light.environment, outputs["--output"].growing)
        facts = _facts(light, captured, reference)
        save_coefficients(light.environment, probe, facts, outputs["--coefficients"].growing)
    except ArlightError:
        abandon(outputs.values(), worth_keeping=False)
        raise
    written = [output.keep() for output in outputs.values()]
    _report(options, probe, captured, light, reference, written)
    return 0


def _measure(
    options: BallOptions, views: list[list[Photograph]], probe: Probe, camera: Camera, reference: float
) -> tuple[list[CapturedBall], BallLight]:
    settings = CaptureSettings(options.transfer, options.allow_clipped)
    captured, lights = [], []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("views", total=len(views))
        for number, photographs in enumerate(views):
            ball = capture_ball(photographs, probe, camera, reference, settings, _circle(options, number))
            _check_place(options, ball, probe)
            captured.append(ball)
            lights.append(ball.picture.light(options.rows, _reflectance(options)))
            progress.advance(task)
    return captured, merge_views(lights)


def _sidecar(options: BallOptions, kind: Literal["probe", "camera"]) -> Path:
    if not options.pictures:
        raise PhotographError("no picture was given; give at least one of the ball beside the sheet")
    given = options.probe if kind == "probe" else options.camera
    path = given or find_sidecar(options.pictures[0], kind)
    if path is None:
        error = ProbeError if kind == "probe" else CameraError
        raise error(f"{options.pictures[0]}: no {kind}.json beside it; give the one of this sheet and camera: --{kind}")
    return path


def _prepare(options: BallOptions, inputs: Sequence[Path]) -> dict[str, Output]:
    if options.output.suffix.lower() not in SUFFIXES:
        raise OutputError(f"{options.output}: --output must end in {' or '.join(SUFFIXES)}")
    coefficients = options.coefficients or options.output.with_suffix(".json")
    return prepare_outputs({"--output": options.output, "--coefficients": coefficients}, [*options.pictures, *inputs])


def _views(options: BallOptions, photographs: list[Photograph]) -> list[list[Photograph]]:
    size = options.per_view or len(photographs)
    if size < 1 or len(photographs) % size:
        raise PhotographError(
            f"--per-view {size}: {len(photographs)} pictures cannot be parted into views of {size}; give every view "
            "the same number of pictures"
        )
    views = [photographs[start : start + size] for start in range(0, len(photographs), size)]
    if options.circle is not None and len(options.circle) != 3 * len(views):
        raise BallError(f"--circle: expected X Y RADIUS for {len(views)} view(s), found {len(options.circle)} numbers")
    return views


def _circle(options: BallOptions, number: int) -> tuple[float, float, float] | None:
    if options.circle is None:
        return None
    x, y, radius = options.circle[3 * number : 3 * number + 3]
    return x, y, radius


def _reference(options: BallOptions, views: list[list[Photograph]]) -> float:
    if options.reference_exposure is None:
        times = sorted(photograph.exposure_s for view in views for photograph in view)
        return times[len(times) // 2]
    if not (np.isfinite(options.reference_exposure) and options.reference_exposure > 0.0):
        raise PhotographError(f"--reference-exposure must be a positive time, found {options.reference_exposure} s")
    return options.reference_exposure


def _reflectance(options: BallOptions) -> np.ndarray:
    if len(options.reflectance) not in (1, 3):
        raise BallError(f"--reflectance: give one number or three, found {len(options.reflectance)}")
    return np.array(options.reflectance)


def _check_place(options: BallOptions, ball: CapturedBall, probe: Probe) -> None:
    """Refuse a ball that would stand under the table with the radius that was given."""
    if options.radius_mm is None:
        return
    if not options.radius_mm > 0.0:
        raise BallError(f"--radius-mm must be positive, found {options.radius_mm}")
    z = _center_mm(ball, options.radius_mm)[2]
    if z < -probe.glass_mm:
        raise BallError(
            f"with a radius of {options.radius_mm:g} mm the ball's centre would lie {-z:.0f} mm below the sheet; it "
            "looks smaller than that: check --radius-mm (half of the diameter) and the circle"
        )


def _center_mm(ball: CapturedBall, radius_mm: float) -> np.ndarray:
    """(3,) centre of the ball, probe frame [mm]."""
    outline, pose = ball.found.outline, ball.picture.camera_from_probe
    seen = outline.distance_mm(radius_mm) * outline.axis
    inverse = Pose(pose.rotation.T, pose.camera_centre_mm)
    return inverse.transform(seen)


def _facts(light: BallLight, captured: list[CapturedBall], reference: float) -> dict[str, object]:
    return {
        "reference_exposure_s": reference,
        "upper_hemisphere_seen": light.coverage,
        "upper_hemisphere_clipped": light.clipped_share,
        "irradiance_from_unseen": light.unseen_irradiance_share(),
        "views": [
            {
                "camera_from_probe_rotation": ball.picture.camera_from_probe.rotation.tolist(),
                "camera_from_probe_translation_mm": ball.picture.camera_from_probe.translation.tolist(),
                "ball_axis": ball.found.outline.axis.tolist(),
                "ball_half_angle_deg": float(np.rad2deg(ball.found.outline.half_angle_rad)),
                "contour_seen": ball.found.contour_share,
            }
            for ball in captured
        ],
    }


def _report(
    options: BallOptions,
    probe: Probe,
    captured: list[CapturedBall],
    light: BallLight,
    reference: float,
    written: Sequence[Path],
) -> None:
    console = Console(soft_wrap=True, highlight=False, markup=False)
    for number, ball in enumerate(captured, 1):
        console.print(f"view {number}: {_described(options, probe, ball)}")
    console.print(
        f"upper hemisphere: {100.0 * light.coverage:.1f} % seen, {100.0 * light.clipped_share:.2f} % clipped; "
        f"{100.0 * light.unseen_irradiance_share():.1f} % of the sheet's light was filled in"
    )
    environment: Environment = light.environment
    level = environment.coefficients(probe.slab, probe.frequencies[:1])[0].real
    console.print(
        f"L_0 (R, G, B): {', '.join(f'{value:.4g}' for value in level)}; 1 is full scale at {reference:.3g} s"
    )
    if options.reflectance == (1.0,):
        console.print("the ball's reflectance was taken as 1; a real one reflects less: --reflectance")
    for path in written:
        console.print(f"  {path}")


def _described(options: BallOptions, probe: Probe, ball: CapturedBall) -> str:
    center, radius = ball.found.outline.circle_px(ball.picture.camera)
    text = f"ball at ({center[0]:.1f}, {center[1]:.1f}), radius {radius:.1f} px"
    if ball.found.contour_share > 0.0:
        text += f", {100.0 * ball.found.contour_share:.0f} % of its contour seen ({ball.found.residual_px:.2f} px rms)"
    else:
        text += ", as given: its contour was not seen"
    if options.radius_mm is not None:
        x, y, z = _center_mm(ball, options.radius_mm)
        return f"{text}; centre at ({x:.0f}, {y:.0f}, {z:.0f}) mm"
    try:
        deduced = ball.found.outline.resting_radius_mm(ball.picture.camera_from_probe, -probe.glass_mm)
    except BallError:
        return f"{text}; it does not rest on the table"
    return f"{text}; {deduced:.1f} mm in radius if it rests on the table"
