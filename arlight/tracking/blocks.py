"""Measure the blocks of one frame: every block's mean, as the paper has it, and the harmonics of its stripes.

Each pixel is used once, as it was decoded. Its film point q and paper point q - D(v) decide whether it belongs to a
block; the pattern's phase at q is known, so one small least-squares fit a block separates mean and harmonics.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_color import color_line
from arlight.tracking.block_kernels import BlockKernels
from arlight.tracking.block_layout import BlockLayout
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.decoding import Decoding, decoding
from arlight.video.frame import Frame

Array = NDArray[np.float64]

_MIN_SAMPLES = 24
"""Pixels that a block's colour must be the mean of."""
_EDGE_PX = 1.5
"""Pixels to keep from a block's border for the pixel's own square and the codec, beside the blur."""
_UNRESOLVED_BLUR_PX = 0.6
_FEWEST_SAMPLES = 16
_ANY_LUMA = 100.0
"""More luma than there is: no pixel is brighter than stripes that are not known."""


class BlockMeter:
    """Measures a sheet's blocks in frames of one camera; buffers are allocated once."""

    def __init__(self, probe: Probe, camera: Camera, max_samples: int = 1200, assembly: Assembly | None = None) -> None:
        """Prepare for a sheet and a camera.

        Args:
            probe: the sheet.
            camera: that films it.
            max_samples: pixels a block is sampled with at most, 16 or more; of larger images some are chosen by chance.
            assembly: where the sheet's film lies and how thick its glass is, when that is known.
        """
        self._camera = camera
        self._layout = BlockLayout.of_probe(probe, assembly)
        self._kernels = BlockKernels(self._layout, camera, max(max_samples, _FEWEST_SAMPLES))

    def measure(
        self,
        frame: Frame,
        pose: Pose,
        blur_px: float = 0.6,
        stripes: Array | None = None,
        blocks: NDArray[np.bool_] | None = None,
        samples: int | None = None,
    ) -> BlockMeans:
        """Means and harmonics of every block, in linear light.

        Args:
            frame: the picture; its size is the camera's.
            pose: camera_from_probe.
            blur_px: standard deviation of the picture's blur [px].
            stripes: (blocks, 7, 3) rows that the last estimate predicts; guide what subsampled chroma cannot show.
            blocks: (blocks,) which to measure; the others cost nothing and are not valid. White blocks among them tell
                how bright a stripe can be. All by default.

        Returns:
            The measurements, in the order of `field_blocks(probe)`.

        Raises:
            CameraError: the frame's size is not the camera's.
        """
        curve = decoding(frame.format.transfer, self._camera.radiometry)
        self._kernels.limit(samples)
        self._kernels.place(pose, _EDGE_PX + (blur_px if np.isfinite(blur_px) else _UNRESOLVED_BLUR_PX), blocks)
        self._kernels.show(frame, curve)
        if stripes is None and max(frame.format.chroma_shift) > 0:
            self._guess_hue(frame, curve)
        return self._kernels.measure(stripes)

    def _guess_hue(self, frame: Frame, curve: Decoding) -> None:
        """Chroma along the line between the colours of black and white regions, as long as no stripes are known."""
        matrix = frame.format.ycc_from_rgb().astype(float)
        luma, chroma = color_line(*self._reference_colors(frame, curve), curve, matrix)
        columns = np.stack([luma, np.ones_like(luma)], axis=1)
        slope, base = np.linalg.lstsq(columns, chroma, rcond=None)[0]
        hue = self._kernels.hue
        hue[:] = 0.0
        hue[:, :2, 0], hue[:, :2, -1] = slope, base
        hue[:, 2, 0], hue[:, 2, -1] = _ANY_LUMA, -1.0

    def _reference_colors(self, frame: Frame, curve: Decoding) -> tuple[Array, Array]:
        """Linear RGB of a black and of a white region, medians over the sheet."""
        average, cells = self._kernels.survey()
        linear = curve.linear(average @ frame.format.rgb_from_ycc().T)
        seen = cells >= _MIN_SAMPLES / 2.0 ** sum(frame.format.chroma_shift)
        layout = self._layout
        black, white = linear[layout.black & seen], linear[layout.white & seen & (linear.max(axis=1) < curve.clip)]
        dark = np.median(black, axis=0) if len(black) else np.zeros(3)
        return dark, np.median(white, axis=0) if len(white) else linear[seen].max(axis=0, initial=1e-3)
