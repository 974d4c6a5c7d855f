"""Writing environments: Radiance (.hdr) or OpenEXR (.exr) latitude-longitude maps, and their coefficients as JSON."""

import json
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
from numpy.typing import NDArray

from arlight.environment import Environment
from arlight.errors import OutputError
from arlight.probe.design import Probe

SUFFIXES = (".hdr", ".exr")
FORMAT = "arlight-light"
VERSION = 1


def save_environment(environment: Environment, path: Path) -> None:
    """Write a map that `Environment.load` reads: .hdr to about 1 %, .exr to single precision.

    Args:
        environment: without a turn, as its file has no place for one.
        path: ends in .hdr or .exr.

    Raises:
        OutputError: the name has another ending, or the file cannot be written.
    """
    if environment.yaw_rad != 0.0:
        raise ValueError("an environment that is turned cannot be written; resample it first")
    radiance = np.ascontiguousarray(environment.radiance, np.float32)
    match path.suffix.lower():
        case ".hdr":
            written = cv2.imwrite(str(path), radiance[..., ::-1])
        case ".exr":
            written = _write_exr(path, radiance)
        case _:
            raise OutputError(f"{path}: an environment is written as {' or '.join(SUFFIXES)}; choose one of them")
    if not written:
        raise OutputError(f"{path}: cannot be written; choose another file")


def save_coefficients(environment: Environment, probe: Probe, facts: Mapping[str, object], path: Path) -> None:
    """Write the coefficients L~_n that a sheet would measure under an environment.

    Args:
        environment: probe frame.
        probe: its glass and frequencies.
        facts: what else is known of the light, by name.
        path: .json file.

    Raises:
        OutputError: the file cannot be written.
    """
    coefficients = environment.coefficients(probe.slab, probe.frequencies)
    content = {
        "format": FORMAT,
        "version": VERSION,
        "glass_mm": probe.glass_mm,
        "refractive_index": probe.refractive_index,
        "frequencies": probe.frequencies.tolist(),
        "coefficients_re": _rounded(coefficients.real),
        "coefficients_im": _rounded(coefficients.imag),
        **facts,
    }
    try:
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another file") from error


def _rounded(values: NDArray[np.float64]) -> list[list[float]]:
    return [[float(f"{value:.7g}") for value in row] for row in values]


def _write_exr(path: Path, radiance: NDArray[np.float32]) -> bool:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    try:
        OpenEXR.File(header, {"RGB": radiance}).write(str(path))
    except (RuntimeError, OSError):
        return False
    return True
