"""NAME.truth.json: the true pose, light and exposure of every frame of a synthetic clip."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Pose
from arlight.errors import ArlightError, OutputError

FORMAT = "arlight-truth"
VERSION = 1


class TruthError(ArlightError):
    """A truth file that cannot be used."""


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """What is true of one frame."""

    pose: Pose
    """camera_from_probe [mm]."""
    coefficients: NDArray[np.complex128]
    """(k, 3) coefficients L~_n of the received lighting, 1 is the camera's full scale [radiance * sr]."""
    exposure: float
    """Factor from the captured environment's radiance to the camera's, in green where white balance drifts."""
    time_s: float
    """Time of the frame [s]."""


@dataclass(frozen=True, slots=True)
class ClipTruth:
    """What is true of a clip."""

    environment: str
    """Name of the captured light."""
    frequencies: NDArray[np.int64]
    """(k, 2) frequencies in the order of the coefficients."""
    frames: tuple[FrameTruth, ...]
    """One entry a frame, in order."""


def save_truth(truth: ClipTruth, path: Path | str) -> None:
    """Write NAME.truth.json.

    Raises:
        OutputError: the file cannot be written.
    """
    content = {
        "format": FORMAT,
        "version": VERSION,
        "environment": truth.environment,
        "frequencies": truth.frequencies.tolist(),
        "frames": [_frame_content(index, frame) for index, frame in enumerate(truth.frames)],
    }
    try:
        Path(path).write_text(json.dumps(content) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: the truth cannot be written ({error.strerror}); choose another folder") from error


def load_truth(path: Path | str) -> ClipTruth:
    """Read NAME.truth.json; coefficients and exposure of a still light may stand once, at the top level.

    Raises:
        TruthError: the file is missing, is not a truth file, or holds arrays of the wrong shape.
    """
    path = Path(path)
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT or content["version"] != VERSION:
            raise TruthError(
                f"{path}: expected format {FORMAT!r} version {VERSION}, "
                f"found {content['format']!r} version {content['version']!r}"
            )
        frequencies = np.array(content["frequencies"], dtype=np.int64).reshape(-1, 2)
        shared = {key: content[key] for key in ("coefficients_re", "coefficients_im", "exposure") if key in content}
        frames = tuple(_frame_from(shared | entry, len(frequencies)) for entry in content["frames"])
        return ClipTruth(str(content.get("environment", "")), frequencies, frames)
    except OSError as error:
        raise TruthError(f"{path}: cannot be read ({error.strerror}); a NAME.truth.json is expected there") from error
    except (KeyError, TypeError, ValueError) as error:
        raise TruthError(
            f"{path}: not a truth file as `arlight synthesize` writes it ({error!r}); write it again"
        ) from error


def _frame_content(index: int, frame: FrameTruth) -> dict[str, Any]:
    return {
        "frame": index,
        "time_s": frame.time_s,
        "camera_from_probe_rotation": frame.pose.rotation.tolist(),
        "camera_from_probe_translation_mm": frame.pose.translation.tolist(),
        "exposure": frame.exposure,
        # seven digits: far below what can be measured, and the file stays small
        "coefficients_re": _rounded(frame.coefficients.real),
        "coefficients_im": _rounded(frame.coefficients.imag),
    }


def _rounded(values: NDArray[np.float64]) -> list[list[float]]:
    return [[float(f"{value:.7g}") for value in row] for row in values]


def _frame_from(entry: dict[str, Any], count: int) -> FrameTruth:
    real, imaginary = (np.array(entry[key], float) for key in ("coefficients_re", "coefficients_im"))
    rotation = np.array(entry["camera_from_probe_rotation"], float)
    translation = np.array(entry["camera_from_probe_translation_mm"], float)
    if not real.shape == imaginary.shape == (count, 3) or rotation.shape != (3, 3) or translation.shape != (3,):
        raise ValueError(
            f"frame {entry['frame']}: coefficients {real.shape} and {imaginary.shape}, rotation {rotation.shape}, "
            f"translation {translation.shape}"
        )
    return FrameTruth(
        Pose(rotation, translation), real + 1j * imaginary, float(entry["exposure"]), float(entry["time_s"])
    )
