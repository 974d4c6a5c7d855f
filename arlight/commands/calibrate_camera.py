"""`arlight calibrate camera`: intrinsics from pictures of a printed board or of the sheet, and response to light."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn

from arlight.calibration.camera.camera_calibration import CameraCalibration, calibrate_views
from arlight.calibration.camera.camera_fit import CameraFit, Expectation
from arlight.calibration.camera.camera_response import CameraResponse, measure_response
from arlight.calibration.camera.charuco import BoardDetector, CharucoBoard, write_board
from arlight.calibration.camera.marker_points import MarkerPoints
from arlight.calibration.camera.picture_source import named_frames
from arlight.calibration.camera.sheet_pictures import TargetPicture, fit_sheet
from arlight.calibration.camera.view_selection import edge_sharpness
from arlight.camera import Camera
from arlight.commands.options.calibrate_camera import CalibrateCameraOptions
from arlight.commands.outputs import Output, abandon, prepare_outputs
from arlight.errors import ArlightError, CalibrationError, OutputError
from arlight.probe.design import Probe
from arlight.probe.pages import Paper
from arlight.probe.storage import load_probe
from arlight.tracking.luma import luma_codes
from arlight.video.frame import Frame

_LOW_COVERAGE = 0.5


def run(options: CalibrateCameraOptions) -> int:
    """Print the board, or measure the camera; returns the exit status.

    Raises:
        ArlightError: something the user can mend, in the pictures, the sheet or an output.
    """
    board = CharucoBoard(options.columns, options.rows, options.square_mm)
    if options.board is not None:
        return _print_board(board, options.board, options.paper)
    probe = _checked(options)
    inputs = [*options.pictures, options.probe, options.camera]
    # the camera may gain its response in place: it is read in full before anything is written
    read = [path for path in inputs if path is None or not _same(path, options.output) or path in options.pictures]
    output = prepare_outputs({"--output": options.output}, read)["--output"]
    try:
        return _measure(options, board, probe, output)
    except (ArlightError, KeyboardInterrupt):
        abandon([output], worth_keeping=False)
        raise


def _print_board(board: CharucoBoard, path: Path, paper: Paper) -> int:
    output = prepare_outputs({"--board": path}, [])["--board"]
    try:
        write_board(board, output.growing, paper)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another --board") from error
    written = output.keep()
    width, height = board.size_mm
    _console().print(
        f"{written}: print at 100 % and check that the board measures {width:g} x {height:g} mm; glue it to something "
        "flat"
    )
    return 0


def _checked(options: CalibrateCameraOptions) -> Probe | None:
    if not options.pictures:
        raise CalibrationError(
            "no pictures: give videos or pictures of the board; `arlight calibrate camera --board board.pdf` prints one"
        )
    if options.response and options.probe is None:
        raise CalibrationError(
            "--response needs the grey wedge on the sheet's frame: film the sheet and give its probe.json, --probe FILE"
        )
    if options.camera is not None and not options.response:
        raise CalibrationError("--camera keeps the intrinsics, which leaves nothing to measure; add --response")
    return None if options.probe is None else load_probe(options.probe)


def _measure(options: CalibrateCameraOptions, board: CharucoBoard, probe: Probe | None, output: Output) -> int:
    console = _console()
    if options.camera is not None:
        camera = Camera.load(options.camera)
    else:
        calibration = _intrinsics(options, board, probe)
        camera = calibration.camera
        for name, value in _facts(calibration):
            console.print(f"{name:<22}{value}")
    if options.response and probe is not None:
        with _Searching("response") as searching:
            frames = searching.watched(named_frames(options.pictures, per_video=12))
            measured = measure_response(_of_camera((frame for _, frame in frames), camera), probe, camera)
        camera = replace(camera, radiometry=measured.radiometry)
        for name, value in _response_facts(measured):
            console.print(f"{name:<22}{value}")
    try:
        camera.save(output.growing)
    except OSError as error:
        raise OutputError(f"{output.path}: cannot be written ({error.strerror}); choose another --output") from error
    console.print(f"  {output.keep()}")
    return 0


def _intrinsics(options: CalibrateCameraOptions, board: CharucoBoard, probe: Probe | None) -> CameraCalibration:
    points = None if probe is None else MarkerPoints(probe)
    detector = BoardDetector(board)
    found: list[TargetPicture] = []
    with _Searching("target") as searching:
        for name, frame in searching.watched(named_frames(options.pictures)):
            if points is not None:
                picture = TargetPicture.of_sheet(frame, points, name)
            else:
                picture = _board_picture(frame, detector, name)
            if picture is not None:
                found.append(picture)
    return calibrate_views(found, None if points is None else partial(_fit_sheet, points))


def _fit_sheet(points: MarkerPoints, pictures: list[TargetPicture], expected: Expectation) -> CameraFit | None:
    return fit_sheet(pictures, points, expected)


def _board_picture(frame: Frame, detector: BoardDetector, name: str) -> TargetPicture | None:
    codes, table = luma_codes(frame)
    view = detector.detect(codes, name)
    if view is None:
        return None
    return TargetPicture(view, frame.index, np.array(codes), table, edge_sharpness(codes, view.pixels))


def _of_camera(frames: Iterable[Frame], camera: Camera) -> Iterator[Frame]:
    for frame in frames:
        if frame.size != camera.image_size:
            raise CalibrationError(
                f"the camera's image_size is {camera.image_size[0]}x{camera.image_size[1]}, a picture has "
                f"{frame.size[0]}x{frame.size[1]}; give pictures of that size"
            )
        yield frame


def _facts(calibration: CameraCalibration) -> list[tuple[str, str]]:
    fit, matrix = calibration.fit, calibration.camera.camera_matrix
    deviation = np.sqrt(np.diag(fit.covariance))
    worst = int(np.argmax(fit.view_rms_px))
    lens = ", ".join(
        f"{name} {value:.4f} +- {stddev:.4f}"
        for name, value, stddev in zip(
            ("k1", "k2", "p1", "p2", "k3"), calibration.camera.distortion, deviation[4:], strict=True
        )
    )
    covered = f"{100.0 * calibration.coverage:.0f} % of the picture covered"
    if calibration.coverage < _LOW_COVERAGE:
        covered += "; distortion beyond is extrapolated: film the target in the corners too"
    rms = float(np.sqrt(np.mean(np.concatenate([np.sum(r**2, axis=1) for r in fit.residuals_px]))))
    return [
        ("focal length", f"{matrix[0, 0]:.1f}, {matrix[1, 1]:.1f} px +- {100.0 * fit.focal_stddev:.2g} %"),
        ("principal point", f"{matrix[0, 2]:.1f} +- {deviation[2]:.1f}, {matrix[1, 2]:.1f} +- {deviation[3]:.1f} px"),
        ("lens", lens),
        (
            "reprojection",
            f"{rms:.3f} px rms over {len(fit.poses)} views, at most {fit.view_rms_px[worst]:.3f} px "
            f"({calibration.names[worst]})",
        ),
        ("coverage", covered),
    ]


def _response_facts(measured: CameraResponse) -> list[tuple[str, str]]:
    curve, fit = measured.radiometry, measured.fit
    low, high = (100.0 * value for value in fit.covered)
    return [
        (
            "response",
            f"within {100.0 * fit.deviation:.1f} % of the footage's own curve from {low:.0f} to {high:.0f} % of full "
            f"scale, {100.0 * fit.residual:.2f} % of full scale left over, {measured.frames} pictures",
        ),
        ("black", f"{curve.black:.4f} +- {fit.black_stddev:.4f} of full scale"),
        ("clipped from", f"{curve.clip:.2f} of full scale"),
        ("noise", f"{curve.read_noise:.4f} in the dark, {curve.shot_gain:.1e} per unit of light (variance)"),
    ]


class _Searching:
    """A line on standard error that says how many pictures were looked at."""

    def __init__(self, title: str) -> None:
        """Prepare the line."""
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            console=Console(stderr=True),
            transient=True,
        )
        self._title = title
        self._task = self._progress.add_task(title, total=None)

    def __enter__(self) -> "_Searching":
        self._progress.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._progress.stop()

    def watched(self, frames: Iterable[tuple[str, Frame]]) -> Iterator[tuple[str, Frame]]:
        """The frames, each named in the line as it comes."""
        for number, (name, frame) in enumerate(frames):
            self._progress.update(self._task, description=f"{self._title}: {name} ({number} done)")
            yield name, frame


def _same(first: Path, second: Path) -> bool:
    return first.resolve() == second.resolve()


def _console() -> Console:
    return Console(soft_wrap=True, highlight=False, markup=False)
