"""What a run amounts to: frames by status, frame rate, median milliseconds per stage."""

from collections import Counter
from dataclasses import dataclass, field
from math import nan
from statistics import median
from time import perf_counter

from arlight.results.record import LogRecord


@dataclass(slots=True)
class RunStatistics:
    """Running totals of a loop over frames."""

    statuses: Counter[str] = field(default_factory=Counter)
    """Frames by status."""
    stages_ms: dict[str, list[float]] = field(default_factory=dict)
    """Milliseconds of every frame by stage."""
    chi2: list[float] = field(default_factory=list)
    """Residual chi-square of every tracked frame that has one."""
    unexplained: list[float] = field(default_factory=list)
    """Share of the stripes that the probe does not explain, of every tracked frame that resolves them."""
    started_s: float = field(default_factory=perf_counter)
    """Clock when the loop began [s]."""
    elapsed_s: float = 0.0
    """Time from there to the last frame [s]."""

    def add(self, record: LogRecord) -> None:
        """Count a frame that is finished."""
        self.statuses[record.status] += 1
        for stage, ms in record.timings_ms.items():
            self.stages_ms.setdefault(stage, []).append(ms)
        if record.status == "tracked" and record.chi2 == record.chi2:
            self.chi2.append(record.chi2)
        if record.status == "tracked" and record.unexplained == record.unexplained:
            self.unexplained.append(record.unexplained)
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
        return {stage: median(values) for stage, values in self.stages_ms.items()}

    @property
    def median_chi2(self) -> float:
        """Median residual chi-square per degree of freedom; nan where no tracked frame has one."""
        return median(self.chi2) if self.chi2 else nan

    @property
    def median_unexplained(self) -> float:
        """Median share of the stripes that the probe does not explain; nan where no tracked frame resolves them."""
        return median(self.unexplained) if self.unexplained else nan
