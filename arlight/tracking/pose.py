"""Where the sheet is in one frame."""

from dataclasses import dataclass
from typing import Literal

from arlight.camera import Pose

Status = Literal["tracked", "coasting", "lost", "left out"]


@dataclass(frozen=True, slots=True)
class ProbePose:
    """The sheet's pose in one frame, and how far it can be trusted."""

    camera_from_probe: Pose | None
    """Rigid transform from probe to camera millimetres; None when the sheet was not found."""
    reprojection_rms_px: float
    """Rms distance of the fiducials from where the pose puts them [px]; nan when the sheet was not found."""
    status: Status
    """`tracked`: measured in this frame; `coasting`: held from earlier frames; `lost`: unknown; `left out`: not looked
    for, to hold a deadline."""
    blur_px: float = float("nan")
    """Standard deviation of the picture's blur at the fiducials, beyond the pixel's own square [px]; nan if unknown."""
    markers_used: int = 0
    """Number of fiducials that the pose rests on."""

    @classmethod
    def lost(cls) -> "ProbePose":
        """The sheet is not in view."""
        return cls(None, float("nan"), "lost")
