"""What `arlight calibrate known` takes."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import tyro

from arlight.commands.options.files import OptionalFile
from arlight.commands.options.footage import SheetAndCamera


@dataclass(frozen=True)
class CalibrateKnownOptions:
    """Find out what a printed sheet became, from clips or pictures of it under lights that are known.

    Each of --frames was lit by the environment in the same place of --environments, given in the sheet's frame: row 0
    its zenith, azimuth from the sheet's x axis toward its y axis, turned by --yaws. Writes the layers and each block's
    corrections for `arlight run --calibration`.
    """

    frames: tuple[Path, ...]
    """Clips or pictures of the sheet, each under one light; from several sides for a camera that will move."""
    environments: tuple[Path, ...]
    """The .hdr or .exr of each, as `arlight ball` makes them."""
    yaws: tuple[float, ...] = ()
    """Turn of each environment about the sheet's normal, counterclockwise from above [deg]; none by default."""
    exposures: tuple[float, ...] = ()
    """Factor on each environment's radiance that makes 1 the camera's full scale; 1 by default."""
    relative: bool = False
    """Leave each light's brightness open, in each channel; then the sheet's own reflectance is taken as stated."""
    estimator: Literal["layers", "fixed"] = "layers"
    """layers: for every viewpoint; fixed: the paper's L = MV, for the one viewpoint of all frames."""
    output: OptionalFile = None
    """The calibration; sheet.calibration.json, or sheet.fixed.npz, by default."""
    calibration: OptionalFile = None
    """A calibration to start from, such as `arlight calibrate self` gives."""
    views: int = 6
    """Frames that are used of each clip, as different in direction as they come."""
    footage: tyro.conf.OmitArgPrefixes[SheetAndCamera] = field(default_factory=SheetAndCamera)
