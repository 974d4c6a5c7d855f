"""The tone curve of a printed layer: what the printer makes of a share of unprinted dots, and how to ask for a value.

Dots grow (dot gain) and ink is not black. Values are relative to the unprinted layer: 1 is unprinted, 0 nothing left.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.errors import ProbeError
from arlight.monotone import interpolate_monotone
from arlight.probe.assembly import Print

Array = NDArray[np.float64]

MEASUREMENT_NOISE = 0.02
"""A measured step may be this much brighter than the next lighter one before the wedge is refused."""
_FEWEST_STEPS = 4
_LARGEST_GAP = 0.3
_LEAST_CONTRAST = 0.2
_LEAST_STEP = 1e-4
_TABLE = 2049


@dataclass(frozen=True, slots=True)
class ToneCurve:
    """A strictly rising curve through measured steps, monotone between them."""

    asked: tuple[float, ...]
    """Share of dots left unprinted, rising from 0 to 1."""
    printed: tuple[float, ...]
    """What that share reflects or transmits relative to the unprinted layer, strictly rising to 1."""

    def __post_init__(self) -> None:
        asked, printed = np.array(self.asked), np.array(self.printed)
        if len(asked) != len(printed) or len(asked) < 2 or asked[0] != 0.0 or asked[-1] != 1.0 or printed[-1] != 1.0:
            raise ProbeError("a tone curve must run from solid (0) to unprinted (1), where it must be 1")
        if not (np.all(np.diff(asked) > 0.0) and np.all(np.diff(printed) > 0.0) and printed[0] >= 0.0):
            raise ProbeError("a tone curve must rise strictly and must not be negative")

    @classmethod
    def of_print(cls, made: Print, steps: int = 33) -> "ToneCurve":
        """The curve of a modelled print."""
        asked = np.linspace(0.0, 1.0, steps)
        return cls(tuple(asked.tolist()), tuple(made.tone(asked).tolist()))

    @classmethod
    def of_wedge(cls, asked: ArrayLike, measured: ArrayLike) -> "ToneCurve":
        """The curve that a measured wedge shows; noise that makes it fall a little is smoothed away.

        Args:
            asked: (s,) shares of dots left unprinted, in any order, with solid (0) and unprinted (1) among them; a
                share that stands more than once is averaged.
            measured: (s,) reflectances or transmittances, on any scale.

        Raises:
            ProbeError: too few steps, one end missing, a step that is no number, contrast too low, or steps that fall
                by more than measurement noise.
        """
        # here, because only a measured wedge needs it and it takes long to load
        from scipy.optimize import isotonic_regression

        shares, where = np.unique(np.round(np.asarray(asked, float), 6), return_inverse=True)
        values = np.asarray(measured, float)
        _check_steps(np.asarray(asked, float), shares, values)
        means = np.bincount(where, values) / np.bincount(where)
        if means[-1] <= 0.0:
            raise ProbeError("the wedge's unprinted step measures 0; check that the values stand in the wedge's order")
        means = means / means[-1]
        _check_rise(shares, means)
        # a step's worth of slope where steps were equal keeps the inverse defined
        rising = isotonic_regression(means).x + _LEAST_STEP * (shares - 1.0)
        rising = np.maximum(rising / rising[-1], _LEAST_STEP * shares)
        return cls(tuple(shares.tolist()), tuple(rising.tolist()))

    @property
    def solid(self) -> float:
        """What solid ink leaves, relative to the unprinted layer."""
        return self.printed[0]

    @property
    def dot_gain(self) -> float:
        """Murray-Davies dot gain at half coverage: how much more than half the light is taken."""
        middle = (float(self.print_of(0.5)) - self.solid) / (1.0 - self.solid)
        return 0.5 - middle

    def print_of(self, asked: ArrayLike) -> Array:
        """What shares of unprinted dots in [0, 1] print as."""
        return interpolate_monotone(np.clip(asked, 0.0, 1.0), self.asked, self.printed)

    def share_for(self, value: ArrayLike) -> Array:
        """The share of unprinted dots that prints as a value; values beyond the curve's ends give its ends."""
        shares = np.linspace(0.0, 1.0, _TABLE)
        return np.interp(np.asarray(value, float), self.print_of(shares), shares)

    def compensated(self, value: ArrayLike) -> Array:
        """The share that prints a design value in [0, 1] in proportion, from what solid ink leaves up to unprinted."""
        return self.share_for(self.solid + (1.0 - self.solid) * np.asarray(value, float))


def _check_steps(asked: Array, shares: Array, values: Array) -> None:
    if asked.shape != values.shape or asked.ndim != 1:
        raise ProbeError(f"a wedge needs a value for each of its {asked.size} steps, found {values.size}")
    if not (np.all(np.isfinite(values)) and np.all(values >= 0.0)):
        raise ProbeError("a wedge's measured values must be numbers, 0 or more; measure the step again")
    if len(shares) < _FEWEST_STEPS or shares[0] != 0.0 or shares[-1] != 1.0 or np.max(np.diff(shares)) > _LARGEST_GAP:
        raise ProbeError(
            f"a wedge needs {_FEWEST_STEPS} or more different steps from solid (0) to unprinted (1), none more than "
            f"{_LARGEST_GAP:g} apart; found {', '.join(f'{share:g}' for share in shares)}"
        )


def _check_rise(shares: Array, means: Array) -> None:
    if means[0] > 1.0 - _LEAST_CONTRAST:
        raise ProbeError(
            f"the wedge's solid step is {means[0]:.2f} of its unprinted one, expected less than "
            f"{1.0 - _LEAST_CONTRAST:g}; check that the values stand in the wedge's order and that ink was not saved"
        )
    for i in np.flatnonzero(np.maximum.accumulate(means)[:-1] - means[1:] > MEASUREMENT_NOISE)[:1]:
        raise ProbeError(
            f"the wedge is not monotone: the step with {shares[i + 1]:.3g} of its dots unprinted measures "
            f"{means[i + 1]:.3f} of the paper, darker than one with fewer; print and measure it again in even light"
        )
