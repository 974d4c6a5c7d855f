"""What a frame reveals beside the lighting: how the picture blurs and shifts the stripes, what the glass mirrors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.prior import COLOR_SPREAD

Array = NDArray[np.float64]


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
    blocks: Array | None = None
    """(2, stride) green's variance granted to what each block mirrors by itself, relative to white squared, and each
    block's weight, in the order of the response's sequence; None if unknown."""

    @classmethod
    def of(
        cls,
        values: Array,
        color_spread: tuple[float, float],
        error_scale: tuple[tuple[float, float], ...],
        shape: Array,
        blocks: Array,
    ) -> "Nuisance":
        """From `values` (5,) and the rest."""
        blur, sharpness, face, x, y = values.tolist()
        return cls(blur, face, color_spread, error_scale, sharpness, (x, y), shape, blocks)

    @property
    def values(self) -> tuple[float, ...]:
        """Blur [px^2], sharpness [px^4], lower face, shift along x and y [px]."""
        return (self.blur_variance_px2, self.sharpness_px4, self.lower_face, *self.shift_px)
