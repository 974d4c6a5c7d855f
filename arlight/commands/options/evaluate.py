"""What `arlight evaluate` takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class EvaluateOptions:
    """Compare a lighting log with the truth: error per order, pose over the sheet, latency.

    The error of an order is the rms over its coefficients and the colour channels of |estimate - truth|, divided by
    |L_0|, the rms over the channels of the true order 0; printed is the median over the frames after the first ten.
    """

    log: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="LOG")]
    """The log that `arlight run --lighting` wrote."""
    truth: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """NAME.truth.json of the clip."""
    json: bool = False
    """Print the figures as JSON instead of a table."""
