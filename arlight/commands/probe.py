"""`arlight probe`: design a sheet and write what is needed to print and use it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from arlight.probe.design import Design
from arlight.probe.layout import design_probe
from arlight.probe.output import write_probe
from arlight.probe.pages import Paper


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
    pixels_per_mm: float = 20.0
    """Resolution of the rasters; 23.6 is 600 dpi."""
    mirror_film: bool = True
    """Print the film mirrored, so that its ink faces the glass."""


def run(options: ProbeOptions) -> int:
    """Write the sheet; returns the exit status.

    Raises:
        ProbeError: the design is impossible or does not fit the page.
        OutputError: the folder cannot be written.
    """
    probe = design_probe(
        order=options.order,
        design=options.design,
        glass_mm=options.glass_mm,
        refractive_index=options.refractive_index,
        pixels_per_mm=options.pixels_per_mm,
        paper=options.paper,
    )
    written = write_probe(probe, options.output, options.paper, options.mirror_film)
    console = Console(soft_wrap=True, highlight=False, markup=False)
    patterns = sum(block.kind == "pattern" for block in probe.blocks)
    console.print(
        f"order {probe.order}, {probe.design}: {patterns} patterned blocks, {len(probe.markers)} markers, "
        f"{probe.sheet_mm[0]:.1f} x {probe.sheet_mm[1]:.1f} mm"
    )
    for path in written:
        console.print(f"  {path}")
    return 0
