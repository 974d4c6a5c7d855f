"""A deadline for the work on a frame."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BudgetOptions:
    """A deadline that is held by giving up accuracy, and as the last resort frames."""

    budget_ms: float | None = None
    """Time that a frame may take from decoded to composed [ms]; none by default."""
    fps: float | None = None
    """The same as frames a second."""
