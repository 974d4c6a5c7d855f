"""How changing light is followed: a step, and a light that moves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.light_direction import strongest_light
from arlight.optics import Slab

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# a step: between two frames the light changes by more than this share of itself
_STEP_SHARE = 0.1
_FOLLOWED = 0.9
# a light that moves: its direction sweeps more than this over the clip, and no step explains it
_MOVING_DEG = 5.0


@dataclass(frozen=True, slots=True)
class Step:
    """A light that was switched, and how the estimate followed."""

    row: int
    """Position, among the compared frames, of the first frame under the new light."""
    frames_to_follow: int | None
    """Frames, that first one counted, until 90 % of the step is followed; None where it never is."""


def find_step(estimated: Complex, true: Complex) -> Step | None:
    """The largest switch of the true light between two frames, and when 90 % of it was followed.

    The share followed is the projection of (estimate - light before) on (light after - light before), all
    coefficients and channels together.

    Args:
        estimated: (frames, k, 3), nan where there is no estimate.
        true: (frames, k, 3).

    Returns:
        None where no two successive frames differ by more than a tenth of the light.
    """
    if len(true) < 2:
        return None
    size = np.linalg.norm(true.reshape(len(true), -1), axis=1)
    change = np.linalg.norm(np.diff(true, axis=0).reshape(len(true) - 1, -1), axis=1)
    share = change / np.maximum(np.maximum(size[:-1], size[1:]), 1e-30)
    row = int(np.argmax(share)) + 1
    if share[row - 1] <= _STEP_SHARE:
        return None
    before = true[row - 1].ravel()
    jump = true[row].ravel() - before
    followed = (estimated[row:].reshape(len(true) - row, -1) - before) @ jump.conj() / np.vdot(jump, jump)
    reached = np.flatnonzero(followed.real >= _FOLLOWED)
    return Step(row, int(reached[0]) + 1 if reached.size else None)


def direction_lag(
    estimated: Complex, true: Complex, frequencies: NDArray[np.int64], slab: Slab, times_s: Array
) -> tuple[float, float] | None:
    """Mean angle between the recovered and the true direction of the strongest light, and how much of it is lag.

    Args:
        estimated: (frames, k, 3), all finite.
        true: (frames, k, 3).
        frequencies: (k, 2) integers.
        slab: the glass of the sheet.
        times_s: (frames,) [s].

    Returns:
        The mean angle [deg], and the mean of its part against the light's own motion [deg] (positive: behind);
        None where the strongest light moves less than 5 degrees over the clip, or where it was switched.
    """
    if len(true) < 3 or find_step(true, true) is not None:
        return None
    right = np.stack([strongest_light(c, frequencies, slab) for c in true])
    if np.degrees(_angle(right, right[:1])).max() < _MOVING_DEG:
        return None
    found = np.stack([strongest_light(c, frequencies, slab) for c in estimated])
    velocity = np.gradient(right, times_s, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    behind = -np.sum((found - right) * velocity / np.maximum(speed, 1e-12), axis=1)
    return float(np.degrees(_angle(found, right)).mean()), float(np.degrees(np.arcsin(np.clip(behind, -1, 1))).mean())


def _angle(a: Array, b: Array) -> Array:
    # the arc cosine of a product near 1 would lose half the digits
    return 2.0 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2.0, 0.0, 1.0))
