"""What `arlight calibrate printer` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.commands.options.files import OptionalFile
from arlight.probe.resolution import Dpi


@dataclass(frozen=True)
class CalibratePrinterOptions:
    """Measure how a printer prints tones, from the wedge that `arlight probe --wedge` writes.

    Print it on the sheet's paper, and on the transparency. Photograph or scan the paper straight from above in even
    light; hold the transparency before an evenly bright white, such as a window with a sheet of paper behind it, and
    photograph that. Switch the scanner's and the camera's corrections off. Or type in what a densitometer reads.
    """

    photo: Annotated[tyro.conf.Positional[Path | None], tyro.conf.arg(metavar="PHOTO")] = None
    """Photograph or scan of the wedge on paper."""
    film_photo: OptionalFile = None
    """Photograph of the wedge on transparency."""
    values: tuple[float, ...] = ()
    """Reflectances of the 28 patches in the order of their numbers, on any linear scale, instead of a photograph."""
    film_values: tuple[float, ...] = ()
    """Transmittances of the 28 patches of the transparency, instead of a photograph."""
    dpi: Dpi | None = None
    """Resolution that the wedge was printed with; photographs show it, typed values do not."""
    update: OptionalFile = None
    """Profile to take the medium from that is not measured now."""
    output: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("printer.json")
    """Profile to write, for `arlight probe --printer-profile`."""
