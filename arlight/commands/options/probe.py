"""What `arlight probe` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import OptionalFile
from arlight.probe.design import Design
from arlight.probe.pages import Paper
from arlight.probe.resolution import Dpi

RASTER_PER_MM = 20.0
"""Resolution of the rasters, as near to which as they can come with whole dots [pixels/mm]."""


@dataclass(frozen=True)
class ProbeOptions:
    """Design a sheet and write what is needed to print and use it.

    The folder gets probe.json (which `arlight run` needs), top.pdf, bottom.pdf and frame.pdf to print at 100 %,
    guide.pdf on how to put them together, the same layers as PNG rasters, and preview.png.
    """

    output: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("probe")
    """Folder to write to; made if it does not exist."""
    order: int = 5
    """Detail of the light that the sheet measures, 1 to 8; a higher order needs a larger sheet."""
    design: Design = "matched"
    """matched: four phases, works from every viewpoint; doubled: the two phases of the original paper."""
    glass_mm: float = 2.44
    """Thickness of the glass between film and paper [mm]; measure yours."""
    refractive_index: float = 1.52
    """Refractive index of the glass: 1.52 window glass, 1.49 acrylic."""
    paper: Paper = "a4"
    """Page to print on."""
    dpi: Dpi | None = None
    """Print dots of this resolution, right in what the sheet measures, and state the error to expect; grey levels for
    the printer to screen by default."""
    printer_profile: OptionalFile = None
    """What `arlight calibrate printer` measured: dot gain is compensated. Gives --dpi."""
    wedge: bool = False
    """Write wedge.pdf alone: tones to print, photograph and give to `arlight calibrate printer`. With
    --printer-profile they are compensated, to check the profile."""
    pixels_per_mm: float = RASTER_PER_MM
    """Resolution of the rasters; with --dpi it follows from that."""
    mirror_film: bool = True
    """Print the film mirrored, so that its ink faces the glass."""
