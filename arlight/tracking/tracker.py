"""The pose of the sheet from frame to frame."""

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera
from arlight.errors import CameraError
from arlight.probe.design import Probe
from arlight.tracking.fiducials import FiducialDetector
from arlight.tracking.planar_pose import poses_from_detections
from arlight.tracking.pose import ProbePose


class PoseTracker:
    """Finds the sheet and follows it.

    Args:
        probe: the sheet.
        camera: intrinsics of the camera that filmed it.
    """

    def __init__(self, probe: Probe, camera: Camera) -> None:
        self._probe = probe
        self._camera = camera
        self._detector = FiducialDetector(probe)

    def reset(self) -> None:
        """Forget everything about earlier frames."""

    def update(
        self, luma: NDArray[np.uint8], time_s: float, linear_table: NDArray[np.float32] | None = None
    ) -> ProbePose:
        """The pose in the next frame.

        Args:
            luma: (h, w) encoded luma as coded in the stream, of the camera's image size.
            time_s: when the frame was taken [s].
            linear_table: (256,) linear light of each code; full-range sRGB by default.

        Returns:
            The pose; status `lost` when the sheet is not in view.

        Raises:
            CameraError: the frame's size is not the camera's.
        """
        width, height = self._camera.image_size
        if luma.shape != (height, width):
            raise CameraError(
                f"the camera's image_size is {width}x{height}, the frame is {luma.shape[1]}x{luma.shape[0]}; "
                "use the camera.json of this footage, or scale its intrinsics to the frame's size"
            )
        for scale in (0.5, 1.0, 2.0):
            hypotheses = poses_from_detections(self._camera, self._probe, self._detector.detect(luma, scale))
            if hypotheses:
                best = hypotheses[0]
                return ProbePose(best.pose, best.rms_px, "tracked", markers_used=best.markers)
        return ProbePose.lost()
