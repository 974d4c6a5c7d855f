"""What a run amounts to: frames by status, frame rate, typical milliseconds per stage; constant memory."""

from collections import Counter
from dataclasses import dataclass, field
from math import isnan, nan
from statistics import median
from time import perf_counter

import numpy as np

from arlight.results.record import LogRecord
from arlight.results.sample import EvenSample

_KEPT = 1024
"""Values that a median is taken of are fewer than this, and exact for runs of fewer frames."""


def _sample() -> EvenSample[float]:
    return EvenSample(_KEPT)


@dataclass(slots=True)
class RunStatistics:
    """Running totals of a loop over frames."""

    statuses: Counter[str] = field(default_factory=Counter)
    """Frames by status."""
    stages_ms: dict[str, EvenSample[float]] = field(default_factory=dict)
    """Milliseconds by stage."""
    wall_ms: EvenSample[float] = field(default_factory=_sample)
    """Milliseconds from the end of one frame to the end of the next."""
    chi2: EvenSample[float] = field(default_factory=_sample)
    """Residual chi-square of the tracked frames that have one."""
    unexplained: EvenSample[float] = field(default_factory=_sample)
    """Share of the stripes that the probe does not explain, of the tracked frames that resolve them."""
    started_s: float = field(default_factory=perf_counter)
    """Clock when the loop began [s]."""
    elapsed_s: float = 0.0
    """Time from there to the last frame [s]."""

    def add(self, record: LogRecord) -> None:
        """Count a frame that is finished."""
        self.statuses[record.status] += 1
        for stage, ms in record.timings_ms.items():
            if stage not in self.stages_ms:
                self.stages_ms[stage] = _sample()
            self.stages_ms[stage].add(ms)
        if not isnan(record.wall_ms):
            self.wall_ms.add(record.wall_ms)
        if record.status == "tracked" and not isnan(record.chi2):
            self.chi2.add(record.chi2)
        if record.status == "tracked" and not isnan(record.unexplained):
            self.unexplained.add(record.unexplained)
        self.elapsed_s = perf_counter() - self.started_s

    @property
    def frames(self) -> int:
        """Frames finished."""
        return self.statuses.total()

    @property
    def tracked(self) -> int:
        """Frames in which the sheet was seen."""
        return self.statuses["tracked"]

    @property
    def tracked_share(self) -> float:
        """Share of the frames in which the sheet was seen, 0 to 1; 0 before the first frame."""
        return self.tracked / self.frames if self.frames else 0.0

    @property
    def frames_per_second(self) -> float:
        """Frames finished per second of wall time."""
        return self.frames / self.elapsed_s if self.elapsed_s > 0.0 else 0.0

    @property
    def median_ms(self) -> dict[str, float]:
        """Median milliseconds per stage."""
        return {stage: median(values.items) for stage, values in self.stages_ms.items()}

    def wall_quantile_ms(self, share: float) -> float:
        """Milliseconds in which that share of the frames was finished after the one before; nan before the second."""
        return float(np.quantile(self.wall_ms.items, share)) if self.wall_ms.items else nan

    @property
    def median_chi2(self) -> float:
        """Median residual chi-square per degree of freedom; nan where no tracked frame has one."""
        return median(self.chi2.items) if self.chi2.items else nan

    @property
    def median_unexplained(self) -> float:
        """Median share of the stripes that the probe does not explain; nan where no tracked frame resolves them."""
        return median(self.unexplained.items) if self.unexplained.items else nan
