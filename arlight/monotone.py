"""Smooth interpolation that does not overshoot: between two knots the curve stays between their values."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def interpolate_monotone(at: ArrayLike, knots: ArrayLike, values: ArrayLike) -> Array:
    """Piecewise cubic Hermite interpolation that is monotone wherever the values are.

    Args:
        at: any shape, within the knots.
        knots: (n,) strictly rising, at least 2.
        values: (n,) at the knots.

    Returns:
        Interpolated values in the shape of `at`; the curve's first derivative is continuous.

    Source:
        Fritsch and Butland, A method for constructing local monotone piecewise cubic interpolants, 1984.
    """
    x, y, place = np.asarray(knots, float), np.asarray(values, float), np.asarray(at, float)
    step = np.diff(x)
    slope = np.diff(y) / step
    tangent = np.full(len(x), slope[0]) if len(x) == 2 else _tangents(step, slope)
    i = np.clip(np.searchsorted(x, place, side="right") - 1, 0, len(step) - 1)
    t = (place - x[i]) / step[i]
    start, end = tangent[i] * step[i], tangent[i + 1] * step[i]
    rise = y[i + 1] - y[i]
    return np.asarray(y[i] + t * (start + t * (3.0 * rise - 2.0 * start - end + t * (start + end - 2.0 * rise))))


def _tangents(step: Array, slope: Array) -> Array:
    """(n,) derivative at each knot: a weighted harmonic mean of the slopes beside it, 0 where they differ in sign."""
    before, after = slope[:-1], slope[1:]
    product = before * after
    wide, near = step[:-1] + 2.0 * step[1:], 2.0 * step[:-1] + step[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = (wide + near) * product / (wide * after + near * before)
    inner = np.where(product > 0.0, inner, 0.0)
    ends = (_end_tangent(*step[:2], *slope[:2]), _end_tangent(*step[:-3:-1], *slope[:-3:-1]))
    return np.concatenate([ends[:1], inner, ends[1:]])


def _end_tangent(step: float, next_step: float, slope: float, next_slope: float) -> float:
    """The derivative at an end by the parabola through three knots, held within what keeps the curve monotone."""
    parabola = ((2.0 * step + next_step) * slope - step * next_slope) / (step + next_step)
    if parabola * slope <= 0.0:
        return 0.0
    if slope * next_slope < 0.0 and abs(parabola) > 3.0 * abs(slope):
        return 3.0 * slope
    return parabola
