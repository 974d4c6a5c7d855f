"""Files on the command line."""

from pathlib import Path
from typing import Annotated

import tyro

File = Annotated[Path, tyro.conf.arg(metavar="FILE")]
OptionalFile = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
PositionalFile = Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FILE")]
