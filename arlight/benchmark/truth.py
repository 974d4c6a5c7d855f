"""The truth beside a synthetic clip: the pose of every frame and the true coefficients of its light."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Pose
from arlight.results.log import LogError

FORMAT = "arlight-truth"
VERSION = 1


@dataclass(frozen=True, slots=True)
class TrueFrame:
    """What is true of one frame."""

    pose: Pose
    """camera_from_probe [mm]."""
    coefficients: NDArray[np.complex128]
    """(k, 3) coefficients of the received lighting, in units of the camera's full scale [radiance * sr]."""
    time_s: float
    """Time of the frame [s]."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What is true of a clip."""

    frequencies: NDArray[np.int64]
    """(k, 2) frequencies in the order of the coefficients."""
    frames: dict[int, TrueFrame]
    """The frames by their index."""


def read_truth(path: Path | str) -> Truth:
    """Read NAME.truth.json; a clip whose light does not change may state its coefficients once, at the top.

    Raises:
        LogError: the file is missing or is not a truth file.
    """
    path = Path(path)
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if content["format"] != FORMAT or content["version"] != VERSION:
            raise ValueError(f"format {content['format']!r}, version {content['version']!r}")
        frequencies = np.array(content["frequencies"], dtype=np.int64).reshape(-1, 2)
        frames = {int(entry["frame"]): _frame_from(content | entry, len(frequencies)) for entry in content["frames"]}
    except OSError as error:
        raise LogError(
            f"{path}: cannot be read ({error.strerror}); expected the NAME.truth.json of the clip"
        ) from error
    except (KeyError, TypeError, ValueError) as error:
        raise LogError(
            f"{path}: not a truth file ({error!r}); expected format {FORMAT!r}, version {VERSION}, "
            "as `arlight synthesize` writes it"
        ) from error
    return Truth(frequencies, frames)


def _frame_from(entry: dict[str, Any], count: int) -> TrueFrame:
    coefficients = np.array(entry["coefficients_re"], float) + 1j * np.array(entry["coefficients_im"], float)
    rotation = np.array(entry["camera_from_probe_rotation"], float)
    translation = np.array(entry["camera_from_probe_translation_mm"], float)
    if coefficients.shape != (count, 3) or rotation.shape != (3, 3) or translation.shape != (3,):
        raise ValueError(f"frame {entry['frame']}: found coefficients {coefficients.shape}, rotation {rotation.shape}")
    return TrueFrame(Pose(rotation, translation), coefficients, float(entry["time_s"]))
