"""What `arlight ball` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from arlight.color import Transfer
from arlight.commands.options.files import File, OptionalFile


@dataclass(frozen=True)
class BallOptions:
    """Photographs of a mirrored ball beside the sheet become known lighting, in the sheet's frame.

    Put a mirrored ball beside the sheet, the camera on a tripod, and photograph both in one picture: several exposures,
    from one in which no lamp is clipped to one in which the room is well lit; sensitivity, aperture, white balance and
    focus fixed. Writes a latitude-longitude map that --environment options take, and its coefficients as JSON.
    """

    pictures: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="PICTURE...")]
    """8-bit sRGB pictures, JPEG or PNG; several exposures of one view, or of several views one after the other."""
    output: File = Path("ball.hdr")
    """The environment, .hdr or .exr."""
    coefficients: OptionalFile = None
    """Its coefficients as JSON; beside the environment, as NAME.json, by default."""
    probe: OptionalFile = None
    """probe.json of the sheet; the one beside the first picture by default."""
    camera: OptionalFile = None
    """camera.json of the camera; the one beside the first picture by default."""
    exposures: tuple[float, ...] | None = None
    """Exposure time of each picture [s], in their order; from EXIF by default."""
    reference_exposure: float | None = None
    """Exposure at which radiance 1 is full scale [s]: that of the video to be compared; the middle one by default."""
    per_view: int | None = None
    """Pictures of each camera position, where there are several positions; all are of one by default."""
    circle: tuple[float, ...] | None = None
    """X Y RADIUS of the ball in the picture [px], for each view; looked for by default."""
    reflectance: tuple[float, ...] = (1.0,)
    """Share of the light that the ball reflects: one number, or red, green and blue; chrome 0.6, silver 0.95."""
    radius_mm: float | None = None
    """Radius of the ball [mm]; deduced from its resting on the table by default. Only says where the ball stands."""
    transfer: Transfer = "srgb"
    """How the camera encodes light."""
    allow_clipped: bool = False
    """Take lamps that clip even in the shortest exposure as they are: the light is then a lower bound."""
    rows: int = 256
    """Rows of the map; it is twice as wide."""
