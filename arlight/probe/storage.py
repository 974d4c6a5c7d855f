"""probe.json: a sheet's description on disk, format `arlight-probe`, version 1. Millimetres, probe frame."""

import json
from pathlib import Path
from typing import Any, cast

import cv2

from arlight.errors import OutputError
from arlight.fourier import MAX_ORDER
from arlight.probe.design import BLOCK_KINDS, DESIGNS, Block, BlockKind, Design, Marker, Probe
from arlight.probe.fields import Field
from arlight.probe.validation import check_geometry

FORMAT = "arlight-probe"
VERSION = 1
DICTIONARIES = tuple(sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_")))

# what can be printed, laid on a table and filmed at all; beyond it a value is a slip of the pen
_LONGEST_MM = 5000.0
_SHORTEST_MM = 0.01
_MOST_PIXELS_PER_MM = 400.0
_HIGHEST_ID = 2**31 - 1


def load_probe(path: Path | str) -> Probe:
    """Read probe.json.

    Raises:
        ProbeError: the file is missing, is not JSON, has another format or version, or holds impossible values; the
            message names the file and the field, what was found and what is allowed.
    """
    content = Field.read(Path(path))
    content.at("format").text([FORMAT])
    content.at("version").integer(VERSION, VERSION)
    order = content.at("order").integer(1, MAX_ORDER)
    fiducials = content.at("fiducials")
    dictionary = fiducials.at("dictionary").text(DICTIONARIES)
    probe = Probe(
        design=cast(Design, content.at("design").text(DESIGNS)),
        order=order,
        sheet_mm=content.at("sheet_mm").pair(_SHORTEST_MM, _LONGEST_MM),
        pixels_per_mm=content.at("pixels_per_mm").number(0.1, _MOST_PIXELS_PER_MM),
        glass_mm=content.at("glass_mm").number(_SHORTEST_MM, _LONGEST_MM),
        # the light plane is not defined at an index of 1, and the slab refuses what is above 4
        refractive_index=content.at("refractive_index").number(1.0001, 4.0),
        dictionary=dictionary,
        markers=_markers(fiducials.at("markers"), dictionary),
        blocks=tuple(_block(item, order) for item in content.at("blocks").items()),
        paper_reflectance=_share(content, "paper_reflectance", 0.9),
        film_transmittance=_share(content, "film_transmittance", 0.95),
    )
    check_geometry(probe, content)
    return probe


def save_probe(probe: Probe, path: Path | str) -> None:
    """Write probe.json; reading it back gives an equal probe.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        Path(path).write_text(json.dumps(_content(probe), indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: the probe cannot be written ({error.strerror}); choose another folder") from error


def _share(content: Field, key: str, default: float) -> float:
    return content.at(key).number(1e-3, 1.0) if content.has(key) else default


def _markers(field: Field, dictionary: str) -> tuple[Marker, ...]:
    size = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList)
    markers = []
    for item in field.items():
        number = item.at("id")
        if number.value not in range(size):
            raise number.refuse(f"a number in {dictionary}, which has 0 to {size - 1}")
        corners = tuple(corner.pair(-_LONGEST_MM, _LONGEST_MM) for corner in item.at("corners_mm").items(4))
        markers.append(Marker(number.integer(0, size - 1), corners))
    return tuple(markers)


def _block(field: Field, order: int) -> Block:
    kind = cast(BlockKind, field.at("kind").text(BLOCK_KINDS))
    size = field.at("size_mm").number(_SHORTEST_MM, _LONGEST_MM)
    return Block(
        id=field.at("id").integer(0, _HIGHEST_ID),
        kind=kind,
        center_mm=field.at("center_mm").pair(-_LONGEST_MM, _LONGEST_MM),
        size_mm=size,
        window_mm=field.at("window_mm").number(_SHORTEST_MM, size),
        frequency=_frequency(field.at("frequency"), order) if kind == "pattern" else None,
        phase_deg=field.at("phase_deg").number(-360.0, 360.0) if kind == "pattern" else None,
        reflectance=field.at("reflectance").number(0.0, 1.0) if kind == "wedge" else None,
    )


def _frequency(field: Field, order: int) -> tuple[int, int]:
    u, v = (item.integer(-order, order) for item in field.items(2))
    if u * u + v * v > order * order:
        raise field.refuse(f"|(u, v)| of at most the sheet's order {order}")
    if not (v > 0 or (v == 0 and u > 0)):
        raise field.refuse("(u, v) with v > 0, or v = 0 and u > 0 (write (-u, -v) with the phase negated)")
    return u, v


def _content(probe: Probe) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": VERSION,
        "design": probe.design,
        "order": probe.order,
        "sheet_mm": list(probe.sheet_mm),
        "pixels_per_mm": probe.pixels_per_mm,
        "glass_mm": probe.glass_mm,
        "refractive_index": probe.refractive_index,
        "paper_reflectance": probe.paper_reflectance,
        "film_transmittance": probe.film_transmittance,
        "fiducials": {
            "dictionary": probe.dictionary,
            "markers": [{"id": m.id, "corners_mm": [list(corner) for corner in m.corners_mm]} for m in probe.markers],
        },
        "blocks": [_block_content(block) for block in probe.blocks],
    }


def _block_content(block: Block) -> dict[str, Any]:
    content: dict[str, Any] = {"kind": block.kind}
    if block.frequency is not None:
        content |= {"frequency": list(block.frequency), "phase_deg": block.phase_deg}
    if block.reflectance is not None:
        content["reflectance"] = block.reflectance
    return content | {
        "center_mm": list(block.center_mm),
        "size_mm": block.size_mm,
        "window_mm": block.window_mm,
        "id": block.id,
    }
