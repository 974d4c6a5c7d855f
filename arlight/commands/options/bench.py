"""What `arlight bench` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import OptionalFile


@dataclass(frozen=True)
class BenchOptions:
    """Measure speed and accuracy together, beside what one would otherwise use.

    Films clips whose truth is known; times every stage of the loop in turns with a yardstick on the same frames
    (OpenCV's ArUco, whole-frame drawing, pyrender, a plain transcode); measures the errors of pose, light and relit
    picture. Costs are told as ratios to the yardsticks, which hardly depend on the machine or on what else it does.
    """

    quick: bool = False
    """A small subset, in a minute; everything takes some ten."""
    json: OptionalFile = None
    """All numbers, as JSON; also what a later --gate compares with."""
    plot: OptionalFile = None
    """A picture of the front of cost against error, .png, .svg or .pdf."""
    gate: Annotated[str | None, tyro.conf.arg(metavar="FILE|shipped")] = None
    """Compare with an earlier run's --json, or with the one that comes with arlight; exit with 1 where a stage is
    1.3 times slower relative to its yardstick or an error 1.1 times worse."""
    frames: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder that keeps the filmed clips for the next run; they are filmed anew and dropped by default."""
    length: float = 60.0
    """Length of the long clip on which the memory of `run` is measured, made by repeating a short one [s]."""
