"""What `arlight figures` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import File, OptionalFile


@dataclass(frozen=True)
class FiguresOptions:
    """Draw the paper's figures 6, 7 and 8: light measured with the sheet beside light measured with a mirrored ball.

    Sheet and ball are photographed together under captured light: once for the sheet, as a bracket for the ball. With
    --compare instead: sheet, mirrored ball and matte ball, one 8-bit picture each, and how well each relights objects.
    """

    output: File = Path("figures.png")
    """The page, .png, .pdf or .svg."""
    json: OptionalFile = None
    """The numbers, as JSON."""
    compare: bool = False
    """Compare sheet, mirrored ball and matte ball instead."""
    environments: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME|FILE...")] = ()
    """Captured lights: hall and bridge by default, all that come with arlight for --compare."""
    turns: int = 3
    """How often each light of --compare is turned about the zenith."""
    order: int = 5
    """Order of the sheet, 1 to 8."""
    size: tuple[int, int] = (1280, 720)
    """Width and height of the pictures [px]."""
    seed: int = 0
    """Chooses the sensor's noise."""
