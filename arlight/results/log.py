"""The lighting log: JSON Lines, a header and then a line a frame, each written as soon as it is known.

A value that is not known is null; NaN never appears. A log whose writer was killed is readable up to its last
complete line.
"""

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.errors import ArlightError, OutputError
from arlight.fourier import frequency_order
from arlight.optics import Slab
from arlight.results.record import LogHeader, LogRecord

FORMAT = "arlight-lighting"
VERSION = 1
_NUMBER = "%.9g"
"""Enough digits for 0.1 um at a metre and for a coefficient's seventh digit; half the file of full precision."""
_UNITS = {
    "coefficients": "radiance * sr; radiance 1 is what the camera records as full scale, linear RGB",
    "stddev": "standard deviation of |coefficient error|, same unit",
    "rvec": "rad, Rodrigues",
    "tvec": "mm",
    "reprojection_rms_px": "px",
    "time_s": "s",
    "timings_ms": "ms",
    "wall_ms": "ms, from the end of the frame before to the end of this one",
}
_CONVENTIONS = {
    "probe": "right-handed, origin at the centre of the film, x right and y up as printed, z out of the sheet",
    "camera": "x right, y down, z forward; pixel centres at integers",
    "rvec, tvec": "camera_from_probe: x_camera = R(rvec) x_probe + tvec",
    "coefficients": "L~_n = integral of received light l~(Delta) exp(-i 2 pi n.Delta) over the light plane, in the "
    "order of `frequencies`; L~_-n = conj(L~_n); Delta points toward the light, |Delta| = 1/2 is the horizon",
}


class LogError(ArlightError):
    """A lighting log or a truth file that cannot be used."""


@dataclass(frozen=True, slots=True)
class LightingLog:
    """A log that was read back."""

    header: LogHeader
    """What the frames have in common."""
    records: tuple[LogRecord, ...]
    """The frames, in the order they were written."""
    truncated: bool
    """Whether the last line was cut off and left out."""


class LightingLogWriter:
    """Writes a log line by line; each line is on its way to the disk before the next frame is looked at."""

    def __init__(self, path: Path, header: LogHeader) -> None:
        """Create the file and write the header.

        Raises:
            OutputError: the file cannot be created.
        """
        self.path = path
        try:
            self._file: TextIO = path.open("w", encoding="utf-8", newline="\n")
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another --lighting") from error
        self._write(json.dumps(_header_json(header), allow_nan=False, separators=(",", ":")))

    def write(self, record: LogRecord) -> None:
        """Append a frame.

        Raises:
            OutputError: the disk is full or the file is gone.
        """
        self._write(_record_line(record))

    def close(self) -> None:
        """Close the file; it is complete up to the last frame written."""
        self._file.close()

    def __enter__(self) -> "LightingLogWriter":
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()

    def _write(self, line: str) -> None:
        try:
            self._file.write(line + "\n")
            self._file.flush()
        except OSError as error:
            raise OutputError(f"{self.path}: writing failed ({error.strerror}); is the disk full?") from error


def read_log(path: Path | str) -> LightingLog:
    """Read a lighting log; a last line that was cut off is left out.

    Raises:
        LogError: the file is missing, is not a lighting log, or is damaged before its last line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise LogError(
            f"{path}: cannot be read ({error.strerror}); a log that `arlight run` wrote is expected"
        ) from error
    except UnicodeDecodeError as error:
        raise LogError(f"{path}: not a text file; a log that `arlight run --lighting` wrote is expected") from error
    header = _header_from(path, lines)
    records: list[LogRecord] = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            records.append(_record_from(json.loads(line), len(header.frequencies)))
        except (KeyError, TypeError, ValueError) as error:
            if number == len(lines):
                return LightingLog(header, tuple(records), truncated=True)
            raise LogError(
                f"{path}, line {number}: not a frame of a lighting log ({error!r}); write it again"
            ) from error
    return LightingLog(header, tuple(records), truncated=False)


def _header_json(header: LogHeader) -> dict[str, Any]:
    camera = header.camera
    return {
        "format": FORMAT,
        "version": VERSION,
        "source": header.source,
        "probe": {
            "file": header.probe,
            "sheet_mm": list(header.sheet_mm),
            "glass_mm": header.slab.glass_mm,
            "refractive_index": header.slab.refractive_index,
        },
        "camera": {
            "image_size": list(camera.image_size),
            "camera_matrix": camera.camera_matrix.tolist(),
            "distortion": camera.distortion.tolist(),
        },
        "frequencies": np.asarray(header.frequencies).tolist(),
        "orders": frequency_order(header.frequencies).tolist(),
        "units": _UNITS,
        "conventions": _CONVENTIONS,
    }


def _header_from(path: Path, lines: list[str]) -> LogHeader:
    try:
        content = json.loads(lines[0])
        if content["format"] != FORMAT:
            raise ValueError(f"its format is {content['format']!r}")
        if content["version"] != VERSION:
            raise LogError(f"{path}: version {content['version']} of the log; this program reads version {VERSION}")
        probe, camera = content["probe"], content["camera"]
        width, height = camera["image_size"]
        return LogHeader(
            frequencies=np.array(content["frequencies"], dtype=np.int64).reshape(-1, 2),
            camera=Camera((int(width), int(height)), camera["camera_matrix"], camera["distortion"]),
            slab=Slab(float(probe["glass_mm"]), float(probe["refractive_index"])),
            sheet_mm=(float(probe["sheet_mm"][0]), float(probe["sheet_mm"][1])),
            source=str(content["source"]),
            probe=str(probe["file"]),
        )
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise LogError(
            f"{path}: not a lighting log ({error}); a file that `arlight run --lighting` wrote is expected"
        ) from error


def _record_line(record: LogRecord) -> str:
    """A frame as JSON; written out here, because a general encoder takes longer for the numbers than the estimate."""
    pose, coefficients = record.pose, record.coefficients
    fields = {
        "frame": str(record.frame),
        "time_s": _number(record.time_s),
        "status": _quoted(record.status),
        "rvec": _numbers(None if pose is None else pose.rvec),
        "tvec": _numbers(None if pose is None else pose.translation),
        "reprojection_rms_px": _number(record.reprojection_rms_px),
        "order": "null" if record.order is None else str(record.order),
        "coefficients_re": _numbers(None if coefficients is None else coefficients.real),
        "coefficients_im": _numbers(None if coefficients is None else coefficients.imag),
        "stddev": _numbers(record.stddev),
        "chi2": _number(record.chi2),
        "unexplained": _number(record.unexplained),
        "timings_ms": _object({stage: _number(ms) for stage, ms in record.timings_ms.items()}),
        "wall_ms": _number(record.wall_ms),
    }
    return _object(fields)


def _record_from(content: dict[str, Any], count: int) -> LogRecord:
    real, imaginary, stddev = content["coefficients_re"], content["coefficients_im"], content["stddev"]
    known = real is not None
    coefficients = np.array(real, float) + 1j * np.array(imaginary, float) if known else None
    if coefficients is not None and (
        coefficients.ndim != 2 or coefficients.shape[0] > count or coefficients.shape[1] != 3
    ):
        raise ValueError(f"expected at most {count} x 3 coefficients, found {coefficients.shape}")
    return LogRecord(
        frame=int(content["frame"]),
        time_s=float(content["time_s"]),
        status=str(content["status"]),
        pose=None if content["rvec"] is None else Pose.from_rvec(content["rvec"], content["tvec"]),
        reprojection_rms_px=_or_nan(content["reprojection_rms_px"]),
        coefficients=coefficients,
        stddev=np.array(stddev, float) if stddev is not None else None,
        order=content["order"],
        chi2=_or_nan(content["chi2"]),
        timings_ms={stage: _or_nan(ms) for stage, ms in content["timings_ms"].items()},
        unexplained=_or_nan(content.get("unexplained")),
        wall_ms=_or_nan(content.get("wall_ms")),
    )


def _object(fields: dict[str, str]) -> str:
    return "{" + ",".join(f"{_quoted(name)}:{value}" for name, value in fields.items()) + "}"


@cache
def _quoted(text: str) -> str:
    return json.dumps(text)


def _number(value: float) -> str:
    return _NUMBER % value if math.isfinite(value) else "null"


def _numbers(values: NDArray[np.float64] | None) -> str:
    """A vector or a matrix, null where it is not known."""
    if values is None:
        return "null"
    flat = tuple(values.ravel().tolist())
    if np.isfinite(values).all():
        return _template(values.shape, _NUMBER) % flat
    return _template(values.shape, "%s") % tuple(_number(value) for value in flat)


@cache
def _template(shape: tuple[int, ...], entry: str) -> str:
    return "[" + ",".join([_template(shape[1:], entry) if len(shape) > 1 else entry] * shape[0]) + "]"


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else float(value)
