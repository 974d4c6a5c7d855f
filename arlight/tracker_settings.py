"""How much is asked of the estimation."""

from dataclasses import dataclass
from typing import Literal

Order = int | Literal["auto", "all"]


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """Choices that trade speed for accuracy."""

    samples_per_block: int = 400
    """Pixels a block is sampled with at most."""
    alignment_levels: int = 1
    """Levels of resolution that the pose is aligned on, 1 to 4; coarser ones are always there to fall back on."""
    iterations: int = 2
    """How often weights and solution are refined in a frame."""
    estimate_every: int = 1
    """The light is measured in every n-th frame that shows the sheet, and predicted in those between."""
    order: Order = "auto"
    """Highest order of the light that is measured, from 0 to the sheet's, or `all` of them. `auto` goes by what the
    data support and the object shows, and takes all where none is drawn; where a lower one does, the light is measured
    in every fourth frame at most. Blocks of higher orders are not looked at."""
    filtered: bool = True
    """Average over time; without it every frame stands alone."""
    bounces: bool = True
    """Model the light reflected between paper and glass; off only for sheets without it."""
