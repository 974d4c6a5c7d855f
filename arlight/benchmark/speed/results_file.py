"""Findings as JSON: the few figures that matter most first, then everything."""

import json
import math
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Any

from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.gate import BaselineError
from arlight.benchmark.speed.machine import describe_machine
from arlight.benchmark.speed.spread import Spread
from arlight.benchmark.speed.workloads import HEADLINE, LARGE

FORMAT = "arlight-bench"
VERSION = 1
SHIPPED = "shipped"
"""Name of the baseline that comes with arlight."""


def headline(found: Findings) -> dict[str, float]:
    """The figures that sum a run up; nan for those that were not measured."""
    loops = {entry["name"]: entry for entry in found.details.get("loop", [])}
    return {
        "estimate_over_aruco": _ratio(found, f"track to filter, {HEADLINE}"),
        "loop_over_transcode": _ratio(found, f"loop, {HEADLINE}"),
        "loop_fps_720p": loops.get(HEADLINE, {}).get("frames_per_second", math.nan),
        "loop_fps_1080p": loops.get(LARGE, {}).get("frames_per_second", math.nan),
        "first_result_s": found.details.get("start", {}).get("first_result_s", math.nan),
        "error_over_bound": found.details.get("bound", {}).get("together", math.nan),
    }


def _ratio(found: Findings, name: str) -> float:
    return found.ratios[name].value.median if name in found.ratios else math.nan


def results_text(found: Findings, quick: bool) -> str:
    """The JSON file of a run."""
    content = {
        "format": FORMAT,
        "version": VERSION,
        **headline(found),
        "quick": quick,
        "machine": describe_machine(),
        "ratios": {name: asdict(ratio) for name, ratio in found.ratios.items()},
        "errors": found.errors,
        **found.details,
        "notes": found.notes,
    }
    return json.dumps(_plain(content), indent=1, allow_nan=False) + "\n"


def load_baseline(name: str) -> Findings:
    """Ratios and errors of an earlier run.

    Args:
        name: the JSON file of that run, or `shipped`.

    Raises:
        BaselineError: it cannot be read, or is something else.
    """
    source = files("arlight.benchmark.speed") / "baseline.json" if name == SHIPPED else Path(name)
    try:
        content = json.loads(source.read_text(encoding="utf-8"))
        if content["format"] != FORMAT or content["version"] != VERSION:
            raise ValueError(f"format {content['format']!r} version {content['version']!r}")
        ratios = {key: _read_ratio(entry) for key, entry in content["ratios"].items()}
        return Findings(ratios, {key: _number(value) for key, value in content["errors"].items()})
    except OSError as error:
        raise BaselineError(
            f"{name}: cannot be read ({error.strerror}); give the JSON file of an earlier `arlight bench --json`, "
            f"or {SHIPPED}"
        ) from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BaselineError(
            f"{name}: not a result of the benchmark ({error!r}); write it with `arlight bench --json`"
        ) from error


def _read_ratio(entry: dict[str, Any]) -> Ratio:
    value = entry["value"]
    median, low, high, least = (_number(value[name]) for name in ("median", "low", "high", "least"))
    return Ratio(Spread(median, low, high, least, int(value["count"])), str(entry["over"]), _number(entry["cost_ms"]))


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _plain(value: Any) -> Any:
    """What JSON can hold: null for what is not finite, six digits."""
    match value:
        case dict():
            return {key: _plain(item) for key, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case bool() | int() | str() | None:
            return value
        case _:
            return float(f"{value:.6g}") if math.isfinite(value) else None
