"""Measure the blocks of one frame: every block's mean, as the paper has it, and the harmonics of its stripes.

Each pixel is used once, as it was decoded. Its film point q and paper point q - D(v) decide whether it belongs to a
block; the pattern's phase at q is known, so one small least-squares fit a block separates mean and harmonics.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking import block_kernels as kernels
from arlight.tracking.block_color import chroma_correction, color_line
from arlight.tracking.block_layout import BlockLayout, BlockView, field_blocks
from arlight.tracking.block_means import ROWS, BlockMeans
from arlight.tracking.decoding import Decoding, decoding
from arlight.video.frame import Frame

Array = NDArray[np.float64]

_BRIGHTEST_STRIPE = 1.1
"""Radiance that no stripe reaches, relative to white: what is brighter is a lamp in the film."""
_LAMP_OVER_AVERAGE = 1.5
"""Radiance over its block's average from which a pixel beyond white shows a lamp."""
_UNCLIPPED_SHARE = 0.35
_MIN_SAMPLES = 24
_LAMP_DEVIATION = 0.02
"""Deviation of a block's pixels from its stripes, relative to the brightest block, that means a lamp in the film."""
_UNRESOLVED_BLUR_PX = 0.6


class BlockMeter:
    """Measures a sheet's blocks in frames of one camera; buffers are allocated once."""

    def __init__(self, probe: Probe, camera: Camera, max_samples: int = 1200, assembly: Assembly | None = None) -> None:
        """Prepare for a sheet and a camera.

        Args:
            assembly: where the sheet's film lies and how thick its glass is, when that is known.
            max_samples: pixels a block is sampled with at most; larger images are strided.
        """
        self._camera = camera
        self._slab = (assembly or Assembly()).slab(probe)
        self._layout = BlockLayout.of_probe(probe, assembly)
        blocks = field_blocks(probe)
        self._patterned = np.array([block.kind == "pattern" for block in blocks])
        self._white = np.array([block.kind == "clear_white" for block in blocks])
        self._black = np.array([block.kind in ("clear_black", "black_white", "black_black") for block in blocks])
        self._max_samples = max_samples
        self._rays = camera.ray_map
        count = len(blocks)
        capacity = min(camera.image_size[0] * camera.image_size[1], 2 * count * max_samples)
        self._pixels = np.empty(capacity, np.int64)
        self._positions = np.empty((capacity, 2))
        self._phases = np.empty(capacity)
        self._used = np.empty(capacity, np.bool_)
        self._encoded = np.empty((capacity, 3))
        self._linear = np.empty((capacity, 3))
        self._chroma = np.empty((capacity, 4))
        self._first = np.empty(count + 1, np.int64)
        self._views = np.empty((count, 3))

    def measure(self, frame: Frame, pose: Pose, blur_px: float = 0.6, stripes: Array | None = None) -> BlockMeans:
        """Means and harmonics of every block, in linear light.

        Args:
            frame: the picture; its size is the camera's.
            pose: camera_from_probe.
            blur_px: standard deviation of the picture's blur [px].
            stripes: (blocks, 7, 3) rows that the last estimate predicts; guide what subsampled chroma cannot show.

        Returns:
            The measurements, in the order of `field_blocks(probe)`.
        """
        view = self._layout.view(self._camera, pose, blur_px if np.isfinite(blur_px) else _UNRESOLVED_BLUR_PX)
        count = self._gather(view, pose)
        self._read(frame, count)
        curve = decoding(frame.format.transfer, self._camera.radiometry)
        trust = np.ones(len(self._first) - 1)
        if max(frame.format.chroma_shift) > 0:
            seen = None if stripes is None else stripes * view.gain[:, None, None]
            trust = self._infer_chroma(frame, curve, view, count, seen)
        matrix = frame.format.rgb_from_ycc().astype(float)
        kernels.linearise(self._encoded, count, matrix, curve.light, self._linear)
        kernels.below(self._linear, self._first, self._ceiling(count, curve.clip), self._used)
        return self._fit(view, trust)

    def _gather(self, view: BlockView, pose: Pose) -> int:
        rotation, translation = pose.rotation, pose.translation
        plane_from_ray = np.linalg.inv(np.column_stack([rotation[:, :2], translation]))
        area = np.prod(np.maximum(view.boxes[:, 2:] - view.boxes[:, :2], 1), axis=1)
        stride = np.maximum(1, np.round(np.sqrt(0.4 * area / self._max_samples))).astype(np.int64)
        layout = self._layout
        kernels.gather(
            view.boxes, layout.centers_mm, layout.half_mm, self._slab.max_offset_mm, view.margin_mm,
            layout.cycles_per_mm, layout.phase_rad, self._rays, plane_from_ray, pose.camera_centre_mm,
            self._slab.glass_mm, self._slab.refractive_index**2, stride, self._pixels, self._positions, self._phases,
            self._first, self._views,
        )  # fmt: skip
        return int(self._first[-1])

    def _read(self, frame: Frame, count: int) -> None:
        """Encoded triples (Y', Cb, Cr), (R', G', B') or three times grey, at the gathered pixels."""
        width = frame.size[0]
        format_ = frame.format
        black, white = format_.luma_code_range
        neutral, swing = format_.chroma_code_range
        shift_x, shift_y = format_.chroma_shift
        for c in range(3):
            plane = frame.planes[min(c, len(frame.planes) - 1)]
            if c == 0 or format_.matrix in ("rgb", "gray"):
                kernels.read_codes(plane, 0, 0, width, self._pixels, count, black, 1.0 / white, c, self._encoded)
            else:
                kernels.read_codes(
                    plane, shift_x, shift_y, width, self._pixels, count, neutral, 1.0 / swing, c, self._encoded
                )

    def _infer_chroma(self, frame: Frame, curve: Decoding, view: BlockView, count: int, stripes: Array | None) -> Array:
        """Bring chroma to full resolution along the blocks' stripes; returns how far it was seen."""
        self._chroma[:count, :2] = self._encoded[:count, 1:]
        expected = self._chroma[:count, 2:]
        matrix = frame.format.ycc_from_rgb().astype(float)
        if stripes is None:
            luma, chroma = color_line(*self._reference_colors(count, frame, curve), curve, matrix)
            for c in range(2):
                expected[:, c] = np.interp(self._encoded[:count, 0], luma, chroma[:, c])
        else:
            kernels.modelled_chroma(self._encoded, self._first, self._phases, stripes, matrix, curve.codes, expected)
        kernels.flatten_chroma(self._first, ~self._patterned, expected)
        self._used[:count] = True
        fitted = self._solve(self._chroma, np.minimum(view.harmonics, 1)).coefficients
        swing = fitted[:, 1] - 1j * fitted[:, 2]
        mean = np.empty((len(self._patterned), 4))
        kernels.block_average(self._chroma[:count], self._first, mean)
        correction = chroma_correction(
            swing[:, :2], swing[:, 2:], mean[:, :2] - mean[:, 2:], view.cycles_per_px, _displacement_px(frame)
        )
        kernels.correct_chroma(self._encoded, self._first, self._phases, expected, correction.shift, correction.swing)
        return correction.trust

    def _ceiling(self, count: int, clip: float) -> Array:
        """(blocks, 3) linear values that only a mirrored lamp exceeds."""
        average = np.empty((len(self._patterned), 3))
        kernels.block_average(self._linear[:count], self._first, average)
        ceiling = np.full_like(average, clip)
        white = average[self._white & (np.diff(self._first) >= _MIN_SAMPLES)]
        if len(white):
            # a lower quartile: some of the white blocks may mirror a lamp themselves
            level = _BRIGHTEST_STRIPE * np.quantile(white, 0.25, axis=0)
            # an evenly bright mirror image, the sky's at grazing view, lifts its block's stripes and hides none
            lifted = np.maximum(level, _LAMP_OVER_AVERAGE * average[~self._white])
            ceiling[~self._white] = np.minimum(lifted, clip)
        return ceiling

    def _reference_colors(self, count: int, frame: Frame, curve: Decoding) -> tuple[Array, Array]:
        """Linear RGB of a black and of a white region, medians over the sheet."""
        average = np.empty((len(self._patterned), 3))
        kernels.block_average(self._encoded[:count], self._first, average)
        linear = curve.linear(average @ frame.format.rgb_from_ycc().T)
        seen = np.diff(self._first) >= _MIN_SAMPLES
        black, white = linear[self._black & seen], linear[self._white & seen & (linear.max(axis=1) < curve.clip)]
        dark = np.median(black, axis=0) if len(black) else np.zeros(3)
        return dark, np.median(white, axis=0) if len(white) else linear[seen].max(axis=0, initial=1e-3)

    def _solve(self, values: Array, harmonics: NDArray[np.int64]) -> "_Fit":
        """Fit all blocks with a linear shading."""
        fit = _Fit.empty(len(harmonics), values.shape[1])
        self._refine(fit, values, harmonics, np.ones_like(harmonics))
        return fit

    def _refine(self, fit: "_Fit", values: Array, harmonics: NDArray[np.int64], degree: NDArray[np.int64]) -> None:
        kernels.fit(
            values, self._used, self._first, self._positions, self._phases, harmonics, degree, fit.coefficients,
            fit.covariance, fit.variance, fit.shading, fit.samples,
        )  # fmt: skip

    def _fit(self, view: BlockView, trust: Array) -> BlockMeans:
        fit = self._solve(self._linear, view.harmonics)
        brightest = float(fit.coefficients[:, 0].max(initial=1e-6))
        lamps = np.sqrt(fit.variance.max(axis=1)) > _LAMP_DEVIATION * brightest
        # what a straight slope leaves is as uneven as the slope itself
        uneven = fit.shading + np.where(lamps[:, None], np.sqrt(fit.variance), 0.0)
        self._refine(fit, self._linear, view.harmonics, np.where(lamps, 3, 0))
        gathered = np.diff(self._first)
        valid = (fit.samples >= _MIN_SAMPLES) & (fit.samples >= _UNCLIPPED_SHARE * gathered)
        views = self._views / np.maximum(gathered, 1)[:, None]
        gain = view.gain[:, None]
        return BlockMeans(
            values=fit.coefficients / gain[..., None],
            covariance=fit.covariance,
            pixel_variance=fit.variance / gain**2,
            shading=uneven / gain,
            harmonics=np.where(fit.samples > 0, view.harmonics, 0),
            samples=fit.samples,
            valid=valid,
            view_phasor=views[:, 0] - 1j * views[:, 1],
            view_cosine=np.where(gathered > 0, views[:, 2], 1.0),
            cycles_per_px=view.cycles_per_px,
            color_trust=trust,
        )


def _displacement_px(frame: Frame) -> Array:
    """(2,) mean vector from a pixel to the chroma sample that it shares [px]."""
    shared = 2.0 ** np.array(frame.format.chroma_shift)
    return np.array(frame.format.chroma_offset_px) - (shared - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class _Fit:
    """Output buffers of the compiled fit."""

    coefficients: Array
    covariance: Array
    variance: Array
    shading: Array
    samples: NDArray[np.int64]

    @classmethod
    def empty(cls, blocks: int, channels: int) -> "_Fit":
        """Buffers of zeros."""
        return cls(
            np.zeros((blocks, ROWS, channels)),
            np.zeros((blocks, ROWS, ROWS)),
            np.zeros((blocks, channels)),
            np.zeros((blocks, channels)),
            np.zeros(blocks, np.int64),
        )
