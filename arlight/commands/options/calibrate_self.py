"""What `arlight calibrate self` takes."""

from dataclasses import dataclass, field

import tyro

from arlight.commands.options.files import OptionalFile, PositionalFile
from arlight.commands.options.footage import SheetAndCamera

FIRST_SECONDS = 6.0
"""How much of a clip is looked at by default [s]."""


@dataclass(frozen=True)
class CalibrateSelfOptions:
    """Find how the sheet was printed and put together, from a camera that moves over it for a few seconds.

    The light may be any, as long as it stays as it is; the camera should see the whole sheet, sharp, from sides that
    differ by 30 degrees or more. The result is found by `arlight run` by itself when it lies beside a clip as
    CLIP.calibration.json or calibration.json.
    """

    clip: PositionalFile
    """The video of the sheet."""
    output: OptionalFile = None
    """The calibration; CLIP.calibration.json in the current folder by default."""
    seconds: float = FIRST_SECONDS
    """How much of the clip to look at [s]."""
    footage: tyro.conf.OmitArgPrefixes[SheetAndCamera] = field(default_factory=SheetAndCamera)
