"""`arlight evaluate`: a lighting log against the truth of its clip."""

import json
import math
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.table import Table

from arlight.benchmark.evaluation import SETTLING_FRAMES, Evaluation, OrderError, evaluate
from arlight.commands.options.evaluate import EvaluateOptions
from arlight.results.log import read_log
from arlight.synthetic.truth import load_truth


def run(options: EvaluateOptions) -> int:
    """Print the figures; returns the exit status.

    Raises:
        LogError, TruthError: log or truth cannot be read, or they belong to different clips.
    """
    log = read_log(options.log)
    evaluation = evaluate(log, load_truth(options.truth))
    console = Console(soft_wrap=True, highlight=False, markup=False)
    if options.json:
        console.out(json.dumps(_without_nan(asdict(evaluation)), indent=1), highlight=False)
        return 0
    if log.truncated:
        console.print(f"{options.log}: the last line is cut off and was left out")
    console.print(_error_table(evaluation))
    for name, value in _facts(evaluation):
        console.print(f"{name:<22}{value}")
    return 0


def _error_table(evaluation: Evaluation) -> Table:
    over = f"after the first {SETTLING_FRAMES}" if evaluation.settled else f"(all: fewer than {SETTLING_FRAMES + 1})"
    table = Table(title=f"coefficient error, median over the frames {over}")
    table.add_column("order")
    table.add_column("relative to |L_0|", justify="right")
    table.add_column("relative to their own size", justify="right")
    for error in evaluation.orders:
        table.add_row(str(error.order), *_percentages(error))
    if evaluation.all_orders is not None:
        table.add_section()
        table.add_row(f"1-{evaluation.all_orders.order}", *_percentages(evaluation.all_orders))
    return table


def _facts(evaluation: Evaluation) -> list[tuple[str, str]]:
    facts = [
        ("tracked", f"{100.0 * evaluation.tracked_share:.1f} % of the clip's frames ({evaluation.frames} compared)")
    ]
    if evaluation.pose is not None:
        pose = evaluation.pose
        facts.append(
            (
                "pose over the sheet",
                f"{pose.rms_px:.3f} px rms (median frame {pose.median_px:.3f}, worst {pose.worst_px:.3f})",
            )
        )
    facts.append(("residual chi-square", f"{evaluation.chi2:.2f} per degree of freedom (median)"))
    if math.isfinite(evaluation.normalised_error):
        facts.append(
            (
                "error over error bar",
                f"{evaluation.normalised_error:.2f} per degree of freedom, squared (mean; honest: 1)",
            )
        )
    if evaluation.step is not None:
        followed = evaluation.step.frames_to_follow
        facts.append(("90 % of the step", "not reached" if followed is None else f"followed within {followed} frames"))
    if evaluation.lag is not None:
        lag = evaluation.lag
        facts.append(
            ("strongest light", f"{lag.mean_deg:.2f} deg from the truth on average, {lag.behind_deg:.2f} deg behind")
        )
    stages = ", ".join(f"{stage} {ms:.2f}" for stage, ms in evaluation.timings_ms.items())
    facts.append(("ms per frame, medians", f"{stages}; together {sum(evaluation.timings_ms.values()):.1f}"))
    return facts


def _percentages(error: OrderError) -> tuple[str, str]:
    return f"{100.0 * error.relative_to_l0:.2f} %", f"{100.0 * error.relative_to_own_size:.1f} %"


def _without_nan(value: Any) -> Any:
    match value:
        case dict():
            return {key: _without_nan(item) for key, item in value.items()}
        case list() | tuple():
            return [_without_nan(item) for item in value]
        case float() if not math.isfinite(value):
            return None
        case _:
            return value
