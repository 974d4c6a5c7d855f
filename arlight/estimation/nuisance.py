"""What a frame reveals beside the lighting: how the picture blurs and shifts the stripes, what the glass mirrors.

All of it enters the rows nearly linearly, so one Gauss-Newton step beside each solution for the lighting finds it; what
it costs the lighting's certainty follows from the same equations.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.prior import COLOR_SPREAD
from arlight.estimation.response import optical_transfer
from arlight.estimation.stripe_rows import HARMONIC_OF_ROW, turned_rows

Array = NDArray[np.float64]

_USUAL = np.array([0.4, 0.0, 1.0, 0.0, 0.0])
"""Blur, sharpness, lower face and shift before a frame has been seen."""
_SPREAD = np.array([1.5, 0.005, 0.5, 0.03, 0.03])
"""Prior standard deviation of each about its usual value."""
_LEAST = np.array([0.0, -0.005, 0.0, -0.3, -0.3])
_MOST = np.array([6.0, 0.01, 1.5, 0.3, 0.3])


@dataclass(frozen=True, slots=True)
class Nuisance:
    """What a frame reveals beside the lighting; one frame's is the next one's first guess."""

    blur_variance_px2: float = 0.4
    """Variance of the picture's blur [px^2]."""
    lower_face: float = 1.0
    """Mirror reflection in the glass's lower face, relative to Fresnel's; less where paper sticks to the glass."""
    color_spread: tuple[float, float] = (COLOR_SPREAD, COLOR_SPREAD)
    """How far red and blue coefficients stray from green's, relative to L~_0 at order 1."""
    error_scale: tuple[tuple[float, float], ...] = ((1.0, 1.0),) * 3
    """Variance of the model's errors in means and harmonics of red, green and blue, relative to the usual."""
    sharpness_px4: float = 0.0
    """What fine stripes keep beyond a Gaussian blur: the logarithm of their amplitude grows by this times the sum of
    the fourth powers of their wave numbers along x and y [px^4]."""
    shift_px: tuple[float, float] = (0.0, 0.0)
    """How far the stripes lie beside where the pose has them [px]."""

    shape: Array | None = None
    """(2k - 1,) green's real-packed coefficients at the measured frequencies, relative to L~_0; None if unknown."""

    def rescaled(self, channel: int, scale: tuple[float, float]) -> "Nuisance":
        """The same with another scale of one channel's errors."""
        scales = list(self.error_scale)
        scales[channel] = scale
        return replace(self, error_scale=tuple(scales))

    def transfer(self, cycles_per_px: Array) -> Array:
        """What the picture leaves of each row (blocks, 7); 1 for the means."""
        gaussian = optical_transfer(cycles_per_px, self.blur_variance_px2)
        return gaussian * np.exp(self.sharpness_px4 * _fineness(_waves(cycles_per_px)))

    def shifted(self, rows: Array, cycles_per_px: Array) -> Array:
        """Rows (blocks, 7, ...) as they appear when all stripes are shifted."""
        return turned_rows(rows, -2.0 * np.pi * cycles_per_px @ np.array(self.shift_px))

    def slopes(self, predicted: Array, mirrored: Array, cycles_per_px: Array) -> Array:
        """Change (blocks, 7, 5) of the rows with blur, sharpness, lower face and shift.

        Args:
            predicted: (blocks, 7) rows; mirrored: (blocks, 7) what of them is due to a lower face of 1.
        """
        wave = _waves(cycles_per_px)
        quarter = np.zeros_like(predicted)
        quarter[:, 1::2], quarter[:, 2::2] = -predicted[:, 2::2], predicted[:, 1::2]
        return np.stack(
            [
                -0.5 * np.sum(wave**2, axis=2) * predicted,
                _fineness(wave) * predicted,
                mirrored,
                wave[:, :, 0] * quarter,
                wave[:, :, 1] * quarter,
            ],
            axis=2,
        )

    def stepped(self, information: Array, right: Array) -> tuple["Nuisance", Array]:
        """One Gauss-Newton step, and the covariance (5, 5) of what it ends at.

        Args:
            information: (5, 5) of the rows about the five, the lighting being unknown; right: (5,) its right-hand side.
        """
        if not np.any(np.diagonal(information) > 0.0):
            return self, np.diag(_SPREAD**2)
        now = np.array([self.blur_variance_px2, self.sharpness_px4, self.lower_face, *self.shift_px])
        covariance = np.asarray(np.linalg.inv(information + np.diag(1.0 / _SPREAD**2)), float)
        moved = np.clip(now + covariance @ (right + (_USUAL - now) / _SPREAD**2), _LEAST, _MOST)
        blur, sharpness, face, x, y = (float(value) for value in moved)
        stepped = replace(self, blur_variance_px2=blur, sharpness_px4=sharpness, lower_face=face, shift_px=(x, y))
        return stepped, covariance


def _waves(cycles_per_px: Array) -> Array:
    """(blocks, 7, 2) wave numbers of the rows' harmonics [rad/px]; 0 for the means."""
    return 2.0 * np.pi * HARMONIC_OF_ROW[:, None] * cycles_per_px[:, None, :]


def _fineness(wave: Array) -> Array:
    """Sum of the wave numbers' fourth powers; pixels show none beyond half their own frequency."""
    return np.asarray(np.sum(np.minimum(np.abs(wave), np.pi) ** 4, axis=-1), float)
