"""The benchmark as a picture: the front, how cost grows, and the ratios to what users would otherwise use."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.workloads import HEADLINE

_PRESET, _POINT, _LINE = "#c1440e", "#7a8a99", "#2b4c6f"
_TICKS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
_STAGES = (
    "track",
    "measure",
    "estimate",
    "filter",
    "track to filter",
    "render",
    "composite",
    "decode",
    "encode",
    "loop",
)


def draw_benchmark(found: Findings) -> Figure:
    """The page; panels of what was not measured are left out."""
    growth = found.details.get("growth", {})
    front = found.details.get("front", [])
    panels = 2 * bool(front) + 1 + len(growth)
    rows = -(-panels // 2)
    figure = Figure(figsize=(13.0, 4.6 * rows), layout="constrained")
    axes = iter(figure.subplots(rows, 2, squeeze=False).ravel())
    if front:
        _draw_front(next(axes), front, "relighting_error", "error of the relit picture, %")
        _draw_front(next(axes), front, "coefficient_error", "error of the coefficients, % of $L_0$")
    _draw_ratios(next(axes), found)
    for axis, rows_of_axis in growth.items():
        _draw_growth(next(axes), axis, rows_of_axis)
    for unused in axes:
        unused.set_axis_off()
    return figure


def _draw_front(axes: Axes, points: list[dict[str, Any]], error: str, label: str) -> None:
    best = sorted(_undominated(points, error), key=lambda point: float(point["cost_ms"]["median"]))
    axes.step(
        [p["cost_ms"]["median"] for p in best], [100.0 * p[error] for p in best],
        where="post", color=_LINE, linewidth=1.2, zorder=1, label="front",
    )  # fmt: skip
    for point in points:
        x, y = point["cost_ms"]["median"], 100.0 * point[error]
        preset = point["is_preset"]
        axes.scatter([x], [y], s=70 if preset else 26, color=_PRESET if preset else _POINT,
                     marker="D" if preset else "o", zorder=3 if preset else 2)  # fmt: skip
        axes.annotate(
            point["name"], (x, y), xytext=(5, 4), textcoords="offset points",
            fontsize=8.5 if preset else 6.5, fontweight="bold" if preset else "normal",
            color=_PRESET if preset else "#444444",
        )  # fmt: skip
    axes.set_xlabel("CPU time a frame, tracking to composite, ms")
    axes.set_ylabel(label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.14, y=0.1)
    for scale in (axes.xaxis, axes.yaxis):
        scale.set_major_locator(LogLocator(subs=_TICKS))
        scale.set_major_formatter(StrMethodFormatter("{x:g}"))
        scale.set_minor_formatter(NullFormatter())
    _finish(axes)


def _undominated(points: list[dict[str, Any]], error: str) -> list[dict[str, Any]]:
    costs = [(point["cost_ms"]["median"], point[error]) for point in points]
    return [
        point
        for point, (x, y) in zip(points, costs, strict=True)
        if not any(a <= x and b <= y and (a, b) != (x, y) for a, b in costs)
    ]


def _draw_ratios(axes: Axes, found: Findings) -> None:
    chosen = [(stage, found.ratios[key]) for stage in _STAGES if (key := f"{stage}, {HEADLINE}") in found.ratios]
    for row, (_stage, ratio) in enumerate(chosen):
        value = ratio.value
        axes.barh(row, value.median, color=_LINE, height=0.6)
        axes.plot([value.low, value.high], [row, row], color="#111111", linewidth=1.0)
        axes.annotate(f" {value.median:.2g}  of {ratio.over}", (value.high, row), va="center", fontsize=7.5)
    axes.axvline(1.0, color="#999999", linewidth=0.8, linestyle="--")
    axes.set_yticks(range(len(chosen)), [stage for stage, _ in chosen])
    axes.invert_yaxis()
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.set_xlim(low, high * (high / low) ** 0.45)
    axes.set_xlabel(f"cost relative to the yardstick, {HEADLINE}; line: 10 to 90 %")
    _finish(axes)


def _draw_growth(axes: Axes, axis: str, rows: list[dict[str, float]]) -> None:
    for part, colour in (("estimate_ms", _LINE), ("relight_ms", _PRESET)):
        axes.plot([row["value"] for row in rows], [row[part] for row in rows], "o-", color=colour,
                  label=part.removesuffix("_ms"))  # fmt: skip
    if rows and rows[-1]["value"] > 100.0 * max(rows[0]["value"], 1.0) ** 0.5:
        axes.set_xscale("log")
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(axis)
    axes.set_ylabel("CPU time a frame, ms")
    axes.legend(frameon=False, fontsize=8)
    _finish(axes)


def _finish(axes: Axes) -> None:
    axes.grid(alpha=0.25, linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)
