"""A camera's radiometry from pictures of the sheet."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from arlight.calibration.camera.paper_samples import PaperSampler, PaperSamples
from arlight.calibration.camera.response_curve import ResponseFit, fit_response, patches_of
from arlight.calibration.camera.sensor_noise import clipping_level, fit_noise
from arlight.camera import Camera
from arlight.errors import CalibrationError
from arlight.probe.design import Probe
from arlight.radiometry import Radiometry
from arlight.tracking.luma import luma_plane
from arlight.tracking.tracker import PoseTracker
from arlight.video.frame import Frame

MOST_FRAMES = 12


@dataclass(frozen=True, slots=True)
class CameraResponse:
    """A camera's radiometry and how it was found."""

    radiometry: Radiometry
    """Response, black, clipping level and noise."""
    fit: ResponseFit
    """The curve's fit."""
    frames: int
    """Pictures that showed the sheet."""


def measure_response(frames: Iterable[Frame], probe: Probe, camera: Camera, stride: int = 1) -> CameraResponse:
    """Response curve, black level, clipping level and noise from pictures of the sheet under unknown smooth light.

    Args:
        frames: pictures of one format; different exposures cover more of the curve.
        probe: the sheet in them.
        camera: its intrinsics; its vignetting is taken out with the light's own slope over the sheet.
        stride: one of so many frames is used, up to twelve.

    Raises:
        CalibrationError: the sheet has no wedge or is not seen, or the pictures do not determine the curve.
    """
    if not any(block.kind == "wedge" for block in probe.blocks):
        raise CalibrationError(
            "the camera's response cannot be measured: the sheet has no grey wedge; `arlight probe` designs one"
        )
    plain = replace(camera, radiometry=None)
    used, samples = _sightings(frames, probe, plain, stride)
    if not used:
        raise CalibrationError(
            "the camera's response cannot be measured: no picture shows the sheet; film its whole frame, sharp, and "
            "give its probe.json (--probe FILE)"
        )
    fit = fit_response(patches_of(samples), used[0].format.transfer, max(probe.sheet_mm) / 2.0)
    curve = Radiometry(fit.response, fit.black)
    curve = replace(curve, clip=clipping_level(used, curve))
    read_noise, shot_gain = fit_noise(samples, curve)
    return CameraResponse(replace(curve, read_noise=read_noise, shot_gain=shot_gain), fit, len(used))


def _sightings(
    frames: Iterable[Frame], probe: Probe, camera: Camera, stride: int
) -> tuple[list[Frame], list[PaperSamples]]:
    """Frames that show the sheet, and their paper.

    Raises:
        CalibrationError: the frames are not encoded alike.
    """
    tracker, sampler = PoseTracker(probe, camera), PaperSampler(probe, camera)
    samples: list[PaperSamples] = []
    used: list[Frame] = []
    for number, frame in enumerate(frames):
        if number % stride:
            continue
        if used and frame.format != used[0].format:
            raise CalibrationError(
                f"the pictures must be encoded alike, found {used[0].format} and {frame.format}; give one camera's, at "
                "one setting"
            )
        codes, table = luma_plane(frame)
        # apart in time: every picture is searched anew
        tracker.reset()
        pose = tracker.update(codes, frame.time_s, table).camera_from_probe
        if pose is not None:
            samples.append(sampler.sample(frame, pose))
            used.append(frame)
        if len(used) >= MOST_FRAMES:
            break
    return used, samples
