"""What `arlight calibrate camera` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import OptionalFile
from arlight.probe.pages import Paper


@dataclass(frozen=True)
class CalibrateCameraOptions:
    """Measure a camera: focal length, principal point, lens distortion; with --response its response to light too.

    1. Print the board: `arlight calibrate camera --board board.pdf`, or use the sheet itself (--probe).
    2. Film it, or take a dozen pictures, from different directions and distances, with zoom and focus locked.
    3. `arlight calibrate camera clip.mp4 --output camera.json`.
    """

    pictures: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="FILE ...")] = ()
    """Videos and pictures of the board or the sheet, all of one size."""
    output: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("camera.json")
    """Camera file to write."""
    board: OptionalFile = None
    """Write the board as a PDF to print at 100 %, and end."""
    paper: Paper = "a4"
    """Page that the board is printed on, in landscape."""
    columns: int = 10
    """Squares across of the board."""
    rows: int = 7
    """Squares down of the board; odd."""
    square_mm: float = 25.0
    """Side of a square [mm]; does not change the intrinsics."""
    probe: OptionalFile = None
    """probe.json of the sheet, where the pictures show the sheet instead of the board."""
    response: bool = False
    """Measure response curve, black and clipping level and noise, from the grey wedge on the sheet's frame."""
    camera: OptionalFile = None
    """Camera file whose intrinsics are kept; with --response, which is then all that is measured."""
