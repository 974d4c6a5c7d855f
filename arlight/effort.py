"""How much work a frame may cost: the settings that can change from one frame to the next."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Effort:
    """Limits to the work on a frame; None where the settings that do not change decide."""

    order: int | None = None
    """Highest order of the light that is measured and drawn."""
    samples_per_block: int | None = None
    """Pixels a block is sampled with at most."""
    estimate_every: int | None = None
    """The light is measured in every n-th frame that shows the sheet at most, and predicted in those between."""
    supersampling: int | None = None
    """Samples along a pixel's side when drawing, at most."""
    shadow: bool = True
    """Whether the object casts one."""
