"""`arlight trace`: the validation suite's path-traced clips, or block means, from captured environments."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console

from arlight.errors import OutputError
from arlight.probe.design import DESIGNS
from arlight.validation.block_responses import save_responses, trace_proof_responses
from arlight.validation.suite import trace_proof


@dataclass(frozen=True)
class TraceOptions:
    """Path-trace the validation suite with Mitsuba 3 (pip install 'arlight[validate]').

    `clips`: one assembled sheet (misregistration, halftones, dot gain, blur, grey ink, thicker glass) under soft
    captured lights, filmed on moving, known and fixed views: NAME.mp4 and NAME.truth.json, with probe.json,
    camera.json, assembly.json and lights/ beside them. `responses`: block means of the sheets as designed, of both
    designs. Takes from ten minutes to an hour.
    """

    captured: Annotated[Path, tyro.conf.arg(metavar="FOLDER")]
    """Folder with the captured environments, latitude-longitude .hdr files named like *hall.hdr."""
    output: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("traced")
    """Folder to write to; must not exist."""
    what: Literal["clips", "responses"] = "clips"
    """What to trace."""


def run(options: TraceOptions) -> int:
    """Trace and write; returns the exit status.

    Raises:
        ArlightError: Mitsuba or an environment is missing, or a file cannot be written.
    """
    if options.output.exists():
        raise OutputError(f"{options.output}: is there already; choose another folder, or remove it first")
    console = Console(soft_wrap=True, highlight=False, markup=False)
    if options.what == "clips":
        trace_proof(options.output, options.captured, lambda name: console.print(f"{options.output / name}.mp4"))
        return 0
    for design in DESIGNS:
        responses = trace_proof_responses(design, options.captured)
        options.output.mkdir(parents=True, exist_ok=True)
        path = options.output / f"responses-{design}.npz"
        save_responses(responses, path)
        console.print(str(path))
    return 0
