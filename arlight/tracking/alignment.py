"""Direct alignment: the pose at which the known fiducials explain the picture's pixels, in linear light.

Gauss-Newton on the six pose parameters over all fiducials at once. The derivatives come from the template, blurred as
the picture is; each marker's gain, its slope over the marker and a bias are projected out, so that light and shadow do
not pull at the pose.

Source: Baker and Matthews, Lucas-Kanade 20 years on, 2004 (the inverse compositional derivative).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.design import Probe
from arlight.tracking.alignment_kernels import AlignmentKernels, Picture

__all__ = ["SAMPLING_VARIANCE_PX2", "WORST_STDDEV_PX", "Alignment", "FiducialAlignment", "Picture"]

Array = NDArray[np.float64]

SAMPLING_VARIANCE_PX2 = 1.0 / 12.0 + 1.0 / 6.0
"""Variance of a pixel's square, and on average of interpolating between pixels [px^2]."""
WORST_STDDEV_PX = 0.3
"""Largest standard deviation of the sheet's corners at which a pose still counts as determined [px]."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """What aligning one picture gave."""

    pose: Pose
    """camera_from_probe."""
    correlation: Array
    """(m,) of each marker with its picture; 0 outside the frame."""
    used: NDArray[np.bool_]
    """(m,) markers that the pose rests on: they correlate by more than 0.8."""
    residual_rms_px: float
    """Rms over the used markers of how far each would still move by itself, freed of the fit's own degrees [px]."""
    stddev_px: float
    """Standard deviation of the sheet's corners that follows from noise and the markers' number and place [px]."""
    blur_px: float
    """Standard deviation of the picture's whole blur, pixel and interpolation included [px]."""

    @property
    def count(self) -> int:
        """How many markers the pose rests on."""
        # of a few, sooner than by numpy
        return sum(self.used.tolist())

    @property
    def accepted(self) -> bool:
        """Whether the markers seen determine the pose: the sheet's corners are not left loose."""
        return self.count > 0 and self.stddev_px < WORST_STDDEV_PX


class FiducialAlignment:
    """Aligns the fiducials of a sheet to pictures of it.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera, lens distortion included.

    Raises:
        ProbeError: the sheet has no fiducials that ArUco knows.
    """

    def __init__(self, probe: Probe, camera: Camera) -> None:
        self._kernels = AlignmentKernels(probe, camera)

    def reset(self) -> None:
        """Forget the earlier pictures: what follows is then the same whatever they were."""
        self._kernels.reset()

    def align(self, picture: Picture, start: Pose, blur_px: float, coarsest: int) -> Alignment | None:
        """The pose near a first guess at which the fiducials fit the picture.

        Args:
            picture: of the camera's image size.
            start: first guess, to within a pixel or two; a few more with a coarser first level.
            blur_px: standard deviation of the whole blur in the picture [px].
            coarsest: the first level shrinks the picture by this: 1, 2, 4 or 8.

        Returns:
            The alignment, or None where no marker is in sight.
        """
        kernels = self._kernels
        kernels.show(picture)
        if not kernels.align(start, blur_px, coarsest):
            return None
        residual_rms_px, stddev_px, blur_px = kernels.result.tolist()
        return Alignment(
            pose=kernels.aligned,
            correlation=kernels.correlation.copy(),
            used=kernels.weight > 0.0,
            residual_rms_px=residual_rms_px,
            stddev_px=stddev_px,
            blur_px=blur_px,
        )
