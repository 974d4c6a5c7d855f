"""NAME.calibration.json: an assembled sheet on disk, format `arlight-calibration`, version 1."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from arlight.errors import OutputError, ProbeError
from arlight.probe.assembly import Assembly, BlockCorrections, Print, Registration
from arlight.probe.fields import Field

FORMAT = "arlight-calibration"
VERSION = 1
_KIND = "NAME.calibration.json"

_LARGEST_SHIFT_MM = 50.0


def save_assembly(
    assembly: Assembly,
    path: Path | str,
    stddev: Mapping[str, float] | None = None,
    vignetting: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Write a calibration; reading it back gives an equal assembly.

    Args:
        stddev: standard deviations to note beside the values, by the calibration's parameter names.
        vignetting: what the calibration found beside the vignetting of the camera's own file.

    Raises:
        OutputError: the file cannot be written.
    """
    content: dict[str, Any] = {"format": FORMAT, "version": VERSION, "glass_scale": assembly.glass_scale}
    content |= {"film": _print_content(assembly.film), "paper": _print_content(assembly.paper)}
    content["vignetting"] = list(vignetting)
    if assembly.blocks is not None:
        content["blocks"] = {name: list(map(float, getattr(assembly.blocks, name))) for name in _BLOCK_RANGES}
    if stddev is not None:
        content["standard_deviations"] = {name: float(value) for name, value in stddev.items()}
    try:
        Path(path).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: the calibration cannot be written ({error.strerror})") from error


def load_assembly(path: Path | str, block_count: int) -> Assembly:
    """Read a calibration.

    Args:
        block_count: how many blocks the field of the sheet has that it is for.

    Raises:
        ProbeError: the file is missing, is not such JSON, holds impossible values, or is for another sheet.
    """
    content = Field.read(Path(path), _KIND)
    content.at("format").text([FORMAT])
    content.at("version").integer(VERSION, VERSION)
    try:
        return Assembly(
            film=_print(content.at("film")),
            paper=_print(content.at("paper")),
            glass_scale=content.at("glass_scale").number(0.51, 1.99),
            blocks=_blocks(content.at("blocks"), block_count) if content.has("blocks") else None,
        )
    except ProbeError as error:
        if str(error).startswith(str(path)):
            raise
        raise ProbeError(f"{path}: {error}") from error


def load_vignetting(path: Path | str) -> tuple[float, float, float]:
    """The vignetting that a calibration found beside the camera's own.

    Raises:
        ProbeError: as for `load_assembly`.
    """
    content = Field.read(Path(path), _KIND)
    if not content.has("vignetting"):
        return 0.0, 0.0, 0.0
    k1, k2, k3 = (item.number(-2.0, 2.0) for item in content.at("vignetting").items(3))
    return k1, k2, k3


_BLOCK_RANGES = {"gain": (0.1, 10.0), "offset": (-1.0, 1.0), "modulation": (-10.0, 10.0), "phase_deg": (-360.0, 360.0)}


def _print(field: Field) -> Print:
    registration = Registration(
        field.at("shift_mm").pair(-_LARGEST_SHIFT_MM, _LARGEST_SHIFT_MM),
        field.at("rotation_deg").number(-180.0, 180.0),
        field.at("scale").number(0.51, 1.99),
    )
    return Print(
        registration,
        field.at("blur_mm").number(0.0, 10.0),
        field.at("dot_gain").number(-0.25, 0.25),
        field.at("solid").number(0.0, 0.99),
    )


def _blocks(field: Field, count: int) -> BlockCorrections:
    arrays = []
    for name, (low, high) in _BLOCK_RANGES.items():
        items = field.at(name).items()
        if len(items) != count:
            raise field.at(name).refuse(f"a number for each of the sheet's {count} blocks", f"{len(items)} numbers")
        arrays.append(np.array([item.number(low, high) for item in items]))
    return BlockCorrections(*arrays)


def _print_content(layer: Print) -> dict[str, Any]:
    return {
        "shift_mm": list(layer.registration.shift_mm),
        "rotation_deg": layer.registration.rotation_deg,
        "scale": layer.registration.scale,
        "blur_mm": layer.blur_mm,
        "dot_gain": layer.dot_gain,
        "solid": layer.solid,
    }
