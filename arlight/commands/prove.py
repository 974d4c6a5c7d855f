"""`arlight prove`: calibrations judged on path-traced clips of an imperfect sheet."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from arlight.benchmark.proof import GROUPS, ClipResult, Treatment, calibrated, judge, medians, uncorrected
from arlight.calibration.layers.self_calibration import SelfCalibration
from arlight.camera import Camera
from arlight.commands.options.prove import ProveOptions
from arlight.commands.outputs import prepare_outputs
from arlight.commands.self_calibration import self_calibrate_clip
from arlight.errors import CalibrationError, VideoError
from arlight.probe.assembly import Assembly
from arlight.probe.assembly_storage import load_assembly, load_vignetting
from arlight.probe.design import Probe
from arlight.probe.storage import load_probe
from arlight.tracking.block_layout import field_blocks

_WIDTH = 140
"""Of the tables, in characters: their rows are not to be wrapped."""
_AS_DESIGNED, _SELF, _KNOWN = "as designed", "self-calibrated", "known light"


def run(options: ProveOptions) -> int:
    """Judge and print; returns the exit status.

    Raises:
        ArlightError: the folder lacks clips, truth, probe, camera or sheet, or the clips do not allow calibration.
    """
    probe, camera = load_probe(options.folder / "probe.json"), Camera.load(options.folder / "camera.json")
    true = load_assembly(options.folder / "assembly.json", len(field_blocks(probe)))
    clips = [clip for path in options.paths for clip in sorted(options.folder.glob(f"{path}-*.mp4"))]
    if not clips:
        names = " or ".join(f"{path}-*.mp4" for path in options.paths)
        raise VideoError(f"{options.folder}: no clips {names}; make them with `arlight trace`")
    outputs = prepare_outputs({"--output": options.output}, [*clips, options.known])
    console = Console(soft_wrap=True, highlight=False, markup=False, width=_WIDTH)
    results: list[ClipResult] = []
    found: dict[str, SelfCalibration] = {}
    for clip in clips:
        try:
            found[clip.stem] = self_calibrate_clip(clip, probe, camera)
        except CalibrationError as error:
            console.print(f"left out: {error}")
            continue
        own = calibrated(_SELF, found[clip.stem], camera)
        judged = judge(clip, probe, own)
        results.append(judged)
        for treatment in [Treatment(_AS_DESIGNED, None, camera), *_known(options.known, probe, camera)]:
            results.append(judge(clip, probe, treatment))
        if options.flaws and clip.stem.startswith(options.paths[0]):
            results.extend(judge(clip, probe, treatment) for treatment in uncorrected(own))
        console.print(f"{clip}: {_summary(judged)}")
    if not results:
        raise VideoError(f"{options.folder}: none of its clips could be calibrated on; trace them again")
    console.print(_error_table(results))
    console.print(_sheet_table(found, true))
    for output in outputs.values():
        content = {"clips": [asdict(result) for result in results], "sheet": {k: v.values for k, v in found.items()}}
        output.growing.write_text(json.dumps(content, indent=1) + "\n")
        console.print(f"{output.keep()}")
    return 0


def _known(path: Path | None, probe: Probe, camera: Camera) -> list[Treatment]:
    if path is None:
        return []
    sheet = load_assembly(path, len(field_blocks(probe)))
    return [Treatment(_KNOWN, sheet, camera.with_more_vignetting(load_vignetting(path)))]


def _summary(result: ClipResult) -> str:
    shown = ", ".join(f"orders {group} {100.0 * np.median(result.errors[group]):.2f} %" for group in GROUPS)
    return f"{result.treatment}: {shown}"


def _error_table(results: Sequence[ClipResult]) -> Table:
    table = Table(title="coefficient error relative to |L_0|, median over frames and clips")
    for column in ("treatment", "clips", *(f"orders {group}" for group in GROUPS)):
        table.add_column(column, justify="left" if column == "treatment" else "right")
    table.add_column("green alone", justify="right")
    table.add_column("error^2 over covariance, raw / filtered", justify="right")
    for name in dict.fromkeys(result.treatment for result in results):
        own = [result for result in results if result.treatment == name]
        errors, green = medians(results, name), medians(results, name, green=True)
        table.add_row(
            name if name in (_AS_DESIGNED, _SELF, _KNOWN) else f"without: {name}",
            str(len(own)),
            *(f"{100.0 * errors[group]:.2f} %" for group in GROUPS),
            " / ".join(f"{100.0 * green[group]:.2f}" for group in GROUPS),
            f"{np.mean([r.normalised_raw for r in own]):.2f} / {np.mean([r.normalised_filtered for r in own]):.2f}",
        )
    return table


def _sheet_table(found: dict[str, SelfCalibration], true: Assembly) -> Table:
    table = Table(title="the sheet, self-calibrated less true")
    for column in ("clip", "paper on film x [mm]", "y [mm]", "turn [deg]", "glass [%]"):
        table.add_column(column, justify="left" if column == "clip" else "right")
    for name, calibration in found.items():
        off = np.array(_on_film(calibration.assembly)) - _on_film(true)
        table.add_row(name, f"{off[0]:.4f}", f"{off[1]:.4f}", f"{off[2]:.4f}", f"{100.0 * off[3]:.2f}")
    return table


def _on_film(sheet: Assembly) -> tuple[float, float, float, float]:
    """Paper relative to film: shift x, y [mm], turn [deg]; and the glass's relative thickness."""
    film, paper = sheet.film.registration, sheet.paper.registration
    shift = np.subtract(paper.shift_mm, film.shift_mm)
    return float(shift[0]), float(shift[1]), paper.rotation_deg - film.rotation_deg, sheet.glass_scale
