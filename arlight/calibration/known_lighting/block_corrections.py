"""Corrections of single blocks as unknowns: their prior toward the model, and their place in a sheet's assembly."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.probe.assembly import Assembly, BlockCorrections

Array = NDArray[np.float64]

KINDS = ("gain", "offset", "modulation", "phase_deg")
"""Columns of an array of corrections (blocks, 4)."""
MODEL = np.array([1.0, 0.0, 1.0, 0.0])
"""Corrections that change nothing."""
STEPS = np.array([1e-3, 1e-3, 1e-3, 0.05])
"""Steps over which the response is linear in a correction."""


_FREEDOM = 4.0
"""Degrees of freedom of the Student-t distribution of corrections."""
_NARROWEST = 0.1
"""A learnt spread is not less than this share of the widest."""


@dataclass(frozen=True, slots=True)
class CorrectionPrior:
    """How far single blocks stray from the layers' model: standard deviations of independent normal errors."""

    gain: float = 0.02
    """Of the factor on all that the paper reflects."""
    offset: float = 0.004
    """Of the reflectance added to the paper's mean, relative to white paper."""
    modulation: float = 0.04
    """Of the factor on the paper's stripes."""
    phase_deg: float = 4.0
    """Of the paper's stripes' lead [deg]."""

    @property
    def stddev(self) -> Array:
        """(4,) in the order of `KINDS`."""
        return np.array([getattr(self, kind) for kind in KINDS], float)


def learnt_prior(
    prior: CorrectionPrior, corrections: Array, variance: Array, widest: CorrectionPrior
) -> tuple[CorrectionPrior, Array]:
    """How far this sheet's blocks stray: the spread under which the corrections that were found are most likely.

    A damped step of MacKay's evidence update, which divides by the number of well-determined corrections; a few blocks
    that are spoilt are let go, as outliers of a Student-t distribution, rather than widen everybody's prior.

    Args:
        prior: the spread that the corrections were found with.
        corrections: (blocks, 4); variance: (blocks, 4) of their errors.
        widest: limit of the spread; a tenth of it is the other.

    Returns:
        The spread, and (blocks, 4) what it comes to for each correction.
    """
    squared = (corrections - MODEL) ** 2
    weight = (_FREEDOM + 1.0) / (_FREEDOM + squared / prior.stddev**2)
    determined = np.sum(np.clip(1.0 - variance * weight / prior.stddev**2, 0.02, 1.0), axis=0)
    spread = np.sqrt(np.sum(weight * squared, axis=0) / determined)
    damped = np.clip(np.sqrt(spread * prior.stddev), _NARROWEST * widest.stddev, widest.stddev)
    return CorrectionPrior(*map(float, damped)), damped / np.sqrt(weight)


def corrections_of(assembly: Assembly, count: int) -> Array:
    """(count, 4) corrections of an assembly's blocks; those that change nothing where it has none."""
    if assembly.blocks is None:
        return np.tile(MODEL, (count, 1))
    return np.stack([getattr(assembly.blocks, kind) for kind in KINDS], axis=1).astype(float)


def with_corrections(assembly: Assembly, corrections: Array, gain: float = 1.0) -> Assembly:
    """The assembly with corrections (blocks, 4), every block's gain multiplied by `gain`."""
    values = corrections * np.array([gain, 1.0, 1.0, 1.0])
    return replace(assembly, blocks=BlockCorrections(*np.ascontiguousarray(values.T)))
