"""How well a lighting log agrees with the truth: light per order, pose over the sheet, step and lag, latency.

Error of a set of coefficients: rms over them and the channels of |estimate - truth|, divided by |L~_0|, the rms over
the channels of the true L~_0. The same divided by the rms of the true coefficients themselves is reported beside it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.consistency import logged_consistency
from arlight.benchmark.following import Step, direction_lag, find_step
from arlight.fourier import frequency_order
from arlight.results.log import LightingLog, LogError
from arlight.results.record import LogHeader, LogRecord
from arlight.synthetic.truth import ClipTruth

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SETTLING_FRAMES = 10
_SHEET_GRID = 11


@dataclass(frozen=True, slots=True)
class OrderError:
    """The error of one order's coefficients, median over the frames after the first ten."""

    order: int
    """ceil(|n|)."""
    relative_to_l0: float
    """rms of |estimate - truth|, divided by |L~_0|."""
    relative_to_own_size: float
    """The same divided by the rms of the order's true coefficients."""


@dataclass(frozen=True, slots=True)
class PoseError:
    """Distance between the sheet's points projected by the estimated and by the true pose."""

    rms_px: float
    """rms over all tracked frames and points [px]."""
    median_px: float
    """Median over the frames of the rms over the sheet [px]."""
    worst_px: float
    """The worst frame's rms over the sheet [px]."""


@dataclass(frozen=True, slots=True)
class DirectionLag:
    """How far the recovered strongest light is behind the true one."""

    mean_deg: float
    """Mean angle between the recovered and the true direction [deg]."""
    behind_deg: float
    """Mean angle by which it trails along the light's motion [deg]; negative: it leads."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """The figures of one log against one truth."""

    frames: int
    """Frames that log and truth have in common."""
    tracked_share: float
    """Share of the truth's frames with status `tracked`, in [0, 1]."""
    orders: tuple[OrderError, ...]
    """Errors per order, from 0."""
    all_orders: OrderError | None
    """The error of orders 1 and up together (its `order` is the highest); None where there is order 0 only."""
    pose: PoseError | None
    """None where no frame was tracked."""
    chi2: float
    """Median residual chi-square per degree of freedom."""
    normalised_error: float
    """Mean squared error over the variance that was reported with it, a degree of freedom: 1 where error bars are
    honest; nan where none were logged."""
    timings_ms: dict[str, float]
    """Median milliseconds per stage."""
    step: Step | None
    """How a switched light was followed; None where nothing was switched."""
    lag: DirectionLag | None
    """How a moving light was followed; None where the light stands still."""
    settled: bool
    """False where the clip is too short for ten frames to be left out: the errors are over all its frames."""


def evaluate(log: LightingLog, truth: ClipTruth) -> Evaluation:
    """Compare a log with the truth of its clip.

    Raises:
        LogError: the two have no frame or no frequency in common.
    """
    records = [record for record in log.records if 0 <= record.frame < len(truth.frames)]
    if not records:
        raise LogError("log and truth have no frame in common; give the truth file of the clip that was run")
    in_log, in_truth = _common_frequencies(log.header.frequencies, truth.frequencies)
    frequencies = log.header.frequencies[in_log]
    times = np.array([record.time_s for record in records])
    true = np.stack([truth.frames[record.frame].coefficients[in_truth] for record in records])
    estimated = np.stack([_coefficients(record, in_log) for record in records])
    stddev = np.stack([_stddev(record, in_log) for record in records])
    settled = [position for position, record in enumerate(records) if record.frame >= SETTLING_FRAMES]
    rows = settled or list(range(len(records)))
    orders = frequency_order(frequencies)
    tracked = sum(record.status == "tracked" for record in records)
    return Evaluation(
        frames=len(records),
        tracked_share=tracked / len(truth.frames),
        orders=tuple(
            order_error(estimated[rows], true[rows], orders == order, int(order)) for order in np.unique(orders)
        ),
        all_orders=order_error(estimated[rows], true[rows], orders > 0, int(orders.max())) if orders.max() else None,
        pose=_pose_error(log.header, records, truth),
        chi2=_median([record.chi2 for record in records]),
        normalised_error=logged_consistency(estimated[rows], stddev[rows], true[rows]),
        timings_ms=_median_timings(records),
        step=find_step(estimated, true),
        lag=_lag(estimated, true, frequencies, log.header, times, rows),
        settled=bool(settled),
    )


def order_error(estimated: Complex, true: Complex, chosen: NDArray[np.bool_], order: int) -> OrderError:
    """Median over frames of the error of the chosen coefficients.

    Args:
        estimated: (frames, k, 3); nan where there is no estimate, which counts as wrong without bound.
        true: (frames, k, 3), (0, 0) first.
        chosen: (k,) which coefficients.
        order: what the set is called.
    """
    difference = np.abs(estimated[:, chosen] - true[:, chosen])
    error = np.sqrt(np.mean(difference**2, axis=(1, 2)))
    error = np.where(np.isnan(error), np.inf, error)
    dc = np.sqrt(np.mean(np.abs(true[:, 0]) ** 2, axis=1))
    own = np.sqrt(np.mean(np.abs(true[:, chosen]) ** 2, axis=(1, 2)))
    with np.errstate(divide="ignore"):
        return OrderError(order, float(np.median(error / dc)), float(np.median(error / own)))


def _common_frequencies(logged: NDArray[np.int64], true: NDArray[np.int64]) -> tuple[list[int], list[int]]:
    place = {tuple(n): row for row, n in enumerate(true.tolist())}
    pairs = [(row, place[tuple(n)]) for row, n in enumerate(logged.tolist()) if tuple(n) in place]
    if not pairs or logged[pairs[0][0]].any():
        raise LogError("log and truth do not share the frequency (0, 0); give the truth file of the clip that was run")
    return [row for row, _ in pairs], [row for _, row in pairs]


def _coefficients(record: LogRecord, rows: list[int]) -> Complex:
    """(k, 3) coefficients of the chosen rows; orders that the frame does not use are zero, no estimate is nan."""
    if record.coefficients is None:
        return np.full((len(rows), 3), np.nan, complex)
    padded = np.zeros((max(rows) + 1, 3), complex)
    count = min(len(padded), len(record.coefficients))
    padded[:count] = record.coefficients[:count]
    return padded[rows]


def _stddev(record: LogRecord, rows: list[int]) -> Array:
    """(k, 3) standard deviations of the chosen rows; nan where none is reported."""
    padded = np.full((max(rows) + 1, 3), np.nan)
    if record.stddev is not None:
        count = min(len(padded), len(record.stddev))
        padded[:count] = record.stddev[:count]
    return padded[rows]


def _pose_error(header: LogHeader, records: list[LogRecord], truth: ClipTruth) -> PoseError | None:
    x, y = (np.linspace(-0.5, 0.5, _SHEET_GRID) * side for side in header.sheet_mm)
    points = np.stack([*np.meshgrid(x, y), np.zeros((_SHEET_GRID, _SHEET_GRID))], axis=-1).reshape(-1, 3)
    squared = []
    for record in records:
        if record.status == "tracked" and record.pose is not None:
            found = header.camera.project(record.pose, points)
            right = header.camera.project(truth.frames[record.frame].pose, points)
            squared.append(float(np.mean(np.sum((found - right) ** 2, axis=1))))
    if not squared:
        return None
    return PoseError(
        rms_px=float(np.sqrt(np.mean(squared))),
        median_px=float(np.sqrt(np.median(squared))),
        worst_px=float(np.sqrt(np.max(squared))),
    )


def _lag(
    estimated: Complex, true: Complex, frequencies: NDArray[np.int64], header: LogHeader, times: Array, rows: list[int]
) -> DirectionLag | None:
    known = [row for row in rows if np.all(np.isfinite(estimated[row]))]
    angles = direction_lag(estimated[known], true[known], frequencies, header.slab, times[known])
    return None if angles is None else DirectionLag(*angles)


def _median(values: list[float]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.median(finite)) if finite else float("nan")


def _median_timings(records: list[LogRecord]) -> dict[str, float]:
    stages = {stage: None for record in records for stage in record.timings_ms}
    return {stage: _median([r.timings_ms[stage] for r in records if stage in r.timings_ms]) for stage in stages}
