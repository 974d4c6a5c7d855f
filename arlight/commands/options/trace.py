"""What `arlight trace` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro


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
