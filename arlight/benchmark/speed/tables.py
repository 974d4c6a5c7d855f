"""The benchmark in a few tables: ratios first, milliseconds of this machine as an aside."""

from collections.abc import Sequence
from math import isfinite

from rich.table import Table

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.gate import Failure
from arlight.benchmark.speed.results_file import headline

_HEADLINES = {
    "estimate_over_aruco": "track to filter over ArUco + solvePnP",
    "loop_over_transcode": "loop over a plain transcode, wall time",
    "loop_fps_720p": "frames a second, 720p",
    "loop_fps_1080p": "frames a second, 1080p",
    "first_result_s": "first result, s",
    "error_over_bound": "error of one frame over the Cramer-Rao bound",
}


def benchmark_tables(found: Findings) -> list[Table]:
    """Tables of what was measured, the sum of it first."""
    tables = [_headline_table(found)]
    if found.details.get("workloads"):
        tables.append(_workload_table(found))
    tables.append(_stage_table(found))
    if found.details.get("budget"):
        tables.append(_budget_table(found))
    if found.details.get("order"):
        tables.append(_order_table(found))
    if found.details.get("front"):
        tables += [_preset_table(found), _front_table(found)]
    return tables


def failure_table(failed: Sequence[Failure]) -> Table:
    """What is worse than the baseline allows."""
    table = Table(title="worse than the baseline allows, measured twice")
    table.add_column("measurement")
    for name in ("before", "now", "10-90 %", "factor", "allowed"):
        table.add_column(name, justify="right")
    for failure in failed:
        scatter = "" if failure.scatter is None else f"{failure.scatter[0]:.3g}-{failure.scatter[1]:.3g}"
        table.add_row(
            failure.name,
            f"{failure.before:.3g}",
            f"{failure.found:.3g}",
            scatter,
            f"{failure.factor:.2f}",
            f"{failure.allowed:g}",
        )
    return table


def _headline_table(found: Findings) -> Table:
    table = Table(show_header=False)
    for name, value in headline(found).items():
        table.add_row(_HEADLINES[name], f"{value:.3g}" if isfinite(value) else "-")
    return table


def _workload_table(found: Findings) -> Table:
    table = Table(title="estimation by workload: cost over the yardstick, errors on the same frames")
    table.add_column("workload")
    for name in ("cost ratio", "pose px", "yardstick's", "light %", "lit object %", "CPU ms"):
        table.add_column(name, justify="right")
    for entry in found.details["workloads"]:
        name = entry["name"]
        table.add_row(
            name,
            f"{found.ratios[f'track to filter, {name}'].value.median:.3f}",
            f"{entry['pose_px']:.3f}",
            f"{entry['yardstick_pose_px']:.3f}",
            _percent(found.errors.get(f"light, {name}")),
            _percent(found.errors.get(f"lit object, {name}")),
            f"{entry['track_to_filter_cpu_ms']['median']:.2f}",
        )
    return table


def _stage_table(found: Findings) -> Table:
    """Stages of the workloads that have drawing and coding too, and what else is compared."""
    table = Table(title="cost over the yardstick, medians of pairs")
    table.add_column("what")
    table.add_column("ratio", justify="right")
    table.add_column("10-90 %", justify="right")
    table.add_column("over")
    table.add_column("ms", justify="right")
    drawn = {entry["name"] for entry in found.details.get("drawing", [])}
    others = {entry["name"] for entry in found.details.get("workloads", [])} - drawn
    for name, ratio in found.ratios.items():
        if name.startswith("auto over all orders") or any(name.endswith(f", {other}") for other in others):
            continue
        value = ratio.value
        table.add_row(
            name, f"{value.median:.3f}", f"{value.low:.3f}-{value.high:.3f}", ratio.over, f"{ratio.cost_ms:.2f}"
        )
    return table


def _budget_table(found: Findings) -> Table:
    table = Table(title="deadlines: from decoded to composed")
    for name in ("ms a frame", "in time %", "late", "left out", "frames at each rung", "relit picture %"):
        table.add_column(name, justify="right")
    for entry in found.details["budget"]:
        table.add_row(
            f"{entry['budget_ms']:g}",
            f"{100.0 * entry['in_time']:.1f}",
            str(entry["late"]),
            str(entry["left_out"]),
            " ".join(str(count) for count in entry["frames_at_rung"]),
            _percent(entry["relighting_error"]),
        )
    return table


def _order_table(found: Findings) -> Table:
    table = Table(
        title="order `auto`: error of the lit object over that of the best order, cost over that of all orders"
    )
    table.add_column("workload")
    table.add_column("object")
    for name in ("best order", "error %", "auto %", "auto over best", "orders taken", "cost"):
        table.add_column(name, justify="right")
    for entry in found.details["order"]:
        best = min(entry["error_by_order"])
        table.add_row(
            entry["name"],
            entry["object"],
            str(entry["error_by_order"].index(best)),
            _percent(best),
            _percent(entry["error_of_auto"]),
            f"{entry['over_best']:.2f}",
            ", ".join(f"{order} ({share:.0%})" for order, share in enumerate(entry["orders"]) if share),
            f"{entry['cost_over_all_orders']:.2f}",
        )
    return table


def _preset_table(found: Findings) -> Table:
    presets = [point for point in found.details["front"] if point["is_preset"]]
    table = Table(title="presets")
    table.add_column("")
    for point in presets:
        table.add_column(point["name"], justify="right")
    table.add_row("track to filter over ArUco", *(f"{p['estimate_over_aruco']['median']:.3f}" for p in presets))
    for stage in presets[0]["stages_ms"]:
        table.add_row(f"{stage}, ms", *(f"{p['stages_ms'][stage]:.2f}" for p in presets))
    for order, _ in enumerate(presets[0]["error_by_order"]):
        table.add_row(f"error of order {order}, % of |L_0|", *(_percent(p["error_by_order"][order]) for p in presets))
    table.add_row("error of the relit picture, %", *(_percent(p["relighting_error"]) for p in presets))
    return table


def _front_table(found: Findings) -> Table:
    table = Table(title="the front: cost against error; * where nothing is both cheaper and better")
    table.add_column("setting")
    for name in ("", "CPU ms", "estimate", "relight", "relit picture %", "light %"):
        table.add_column(name, justify="right")
    for point in sorted(found.details["front"], key=lambda point: float(point["cost_ms"]["median"])):
        table.add_row(
            point["name"].upper() if point["is_preset"] else point["name"],
            "*" if point["on_front"] else "",
            f"{point['cost_ms']['median']:.2f}",
            f"{point['estimate_ms']:.2f}",
            f"{point['relight_ms']:.2f}",
            _percent(point["relighting_error"]),
            _percent(point["coefficient_error"]),
        )
    return table


def _percent(share: float | None) -> str:
    return f"{100.0 * share:.2f}" if share is not None and isfinite(share) else "-"
