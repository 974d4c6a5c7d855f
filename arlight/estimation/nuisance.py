"""What a frame reveals beside the lighting: how the picture blurs and shifts the stripes, what the glass mirrors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.prior import COLOR_SPREAD

Array = NDArray[np.float64]

NUMBERS = 14
"""Length of `Nuisance.numbers`."""


@dataclass(frozen=True, slots=True, eq=False)
class Nuisance:
    """What a frame reveals beside the lighting; one frame's is the next one's first guess."""

    numbers: Array
    """(14,) blur [px^2], sharpness [px^4], lower face, shift x and y [px]; colour spread of red, of green, which has
    none, and of blue; error scales of means and harmonics of red, of green and of blue."""
    shape: Array | None = None
    """(2k - 1,) green's real-packed coefficients at the measured frequencies, relative to L~_0; None if unknown."""
    blocks: Array | None = None
    """(2, stride) green's variance granted to what each block mirrors by itself, relative to white squared, and each
    block's weight, in the order of the response's sequence; None if unknown."""

    @classmethod
    def guess(
        cls,
        blur_variance_px2: float = 0.4,
        lower_face: float = 1.0,
        color_spread: tuple[float, float] = (COLOR_SPREAD, COLOR_SPREAD),
        error_scale: tuple[tuple[float, float], ...] = ((1.0, 1.0),) * 3,
        sharpness_px4: float = 0.0,
        shift_px: tuple[float, float] = (0.0, 0.0),
    ) -> "Nuisance":
        """What to start from where no light has been seen yet; arguments are as the properties."""
        scales = [scale for channel in error_scale for scale in channel]
        spreads = color_spread[0], 0.0, color_spread[1]
        return cls(np.array([blur_variance_px2, sharpness_px4, lower_face, *shift_px, *spreads, *scales], np.float64))

    @property
    def blur_variance_px2(self) -> float:
        """Variance of the picture's blur [px^2]."""
        return float(self.numbers[0])

    @property
    def sharpness_px4(self) -> float:
        """What fine stripes keep beyond a Gaussian blur [px^4].

        The logarithm of their amplitude grows by this times the sum of the fourth powers of their wave numbers along x
        and y.
        """
        return float(self.numbers[1])

    @property
    def lower_face(self) -> float:
        """Mirror reflection in the glass's lower face, relative to Fresnel's; less where paper sticks to the glass."""
        return float(self.numbers[2])

    @property
    def shift_px(self) -> tuple[float, float]:
        """How far the stripes lie beside where the pose has them [px]."""
        return float(self.numbers[3]), float(self.numbers[4])

    @property
    def color_spread(self) -> tuple[float, float]:
        """How far red and blue coefficients stray from green's, relative to L~_0 at order 1."""
        return float(self.numbers[5]), float(self.numbers[7])

    @property
    def error_scale(self) -> tuple[tuple[float, float], ...]:
        """Variance of the model's errors in means and harmonics of red, green and blue, relative to the usual."""
        scales = self.numbers[8:].tolist()
        return tuple(zip(scales[::2], scales[1::2], strict=True))
