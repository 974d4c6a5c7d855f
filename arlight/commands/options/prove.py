"""What `arlight prove` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import OptionalFile


@dataclass(frozen=True)
class ProveOptions:
    """Judge self-calibration, and a calibration from known light, on the clips that `arlight trace` made.

    Every clip NAME-LIGHT.mp4 of a moving camera is self-calibrated and followed; printed are the median errors over
    frames and clips, how honest the error bars are, how well the sheet itself was found, and what each of its flaws
    costs when it is left uncorrected. Takes about a minute a clip.
    """

    folder: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FOLDER")]
    """The traced clips, with probe.json, camera.json and assembly.json."""
    known: OptionalFile = None
    """Calibration from known light, of `arlight calibrate known` on the folder's known-LIGHT clips."""
    paths: tuple[str, ...] = ("orbit", "dive", "hand")
    """Camera paths to judge: clips whose names begin so."""
    flaws: bool = True
    """Also leave each flaw uncorrected in turn, on the first path."""
    output: OptionalFile = None
    """All figures as JSON."""
