"""How large the model's errors are in a frame, told by the residuals: variance components by restricted likelihood.

The errors of a row are the pixels' noise, which is known, and a scale times a usual variance for what model and codec
leave out, with one scale for the means and one for the harmonics. A step of the minorise-maximise iteration raises the
likelihood of the residuals, of which the fit has taken its share; repeated frame by frame it converges.

Source: Zhou, Hu, Zhou, Lange, "MM algorithms for variance components models", 2019, section 2, for residuals.
"""

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.row_noise import ALIKE, RowNoise

Array = NDArray[np.float64]

_LEAST, _MOST = 0.003, 10.0
_ROBUST = (1.06, 0.91)
"""What robust weights make of the squared residuals of means and harmonics when all is as expected."""
_SEEN = 0.5
"""Trust from which a row of red or blue was seen rather than inferred."""


def row_scale(scale: tuple[float, float]) -> Array:
    """(7,) scale of each row from those of means and harmonics."""
    return np.repeat(scale, (1, len(ALIKE) - 1))


def next_scales(
    scale: tuple[float, float],
    noise: RowNoise,
    sparkle: float,
    ordinary: Array,
    usable: NDArray[np.bool_],
    pull: Array,
    left: Array,
) -> tuple[float, float]:
    """One step for means and harmonics.

    Args:
        scale: of the model's errors, as the fit had it.
        noise: of the rows.
        sparkle: usual variance of what a block mirrors beside the smooth field, a part of the means' errors; ordinary:
            (blocks,) all that the fit granted for it.
        usable: (blocks, 7) rows that were fitted.
        pull: (blocks, 7) precision times residual.
        left: (blocks, 7, 7) what the fit leaves of the precision.
    """
    rows = row_scale(scale)
    model = noise.model / noise.trust**2
    own = noise.variance(0.0 * rows)
    model[:, 0] += sparkle
    own[:, 0] += ordinary - scale[0] * sparkle
    total = own + rows * model
    # of the total only this share leaves a residual
    expected = np.diagonal(left, axis1=1, axis2=2) * (own + rows * model / ALIKE)
    found = pull**2 * total
    judged = usable & (noise.trust > _SEEN)
    share = np.divide(model, total, out=np.zeros_like(model), where=total > 0.0)
    mean, harmonics = slice(0, 1), slice(1, None)
    steps = [
        _step(found[:, rows], expected[:, rows], share[:, rows], judged[:, rows], robust)
        for rows, robust in zip((mean, harmonics), _ROBUST, strict=True)
    ]
    return tuple(float(np.clip(old * step, _LEAST, _MOST)) for old, step in zip(scale, steps, strict=True))  # type: ignore[return-value]


def _step(found: Array, expected: Array, share: Array, judged: NDArray[np.bool_], robust: float) -> float:
    """Factor on a scale, 1 where nothing tells it."""
    due = float(np.sum((share * expected)[judged]))
    if due <= 0.0:
        return 1.0
    freedom = float(np.sum(expected[judged]))
    # what chance may add to the residuals is not taken for an error of the model
    chance = 1.0 + np.sqrt(2.0 / (freedom + 1.0))
    return float(np.sqrt(np.sum((share * found)[judged]) / (due * robust * chance)))
