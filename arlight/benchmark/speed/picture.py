"""The benchmark as a picture: the front, the ratios to what users would otherwise use, and how cost grows."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.front_picture import LINE, PRESET, draw_front
from arlight.benchmark.speed.workloads import HEADLINE

_STAGES = (
    "track",
    "measure",
    "estimate",
    "filter",
    "track to filter",
    "render",
    "composite",
    "relight",
    "decode",
    "encode",
    "loop",
)


def draw_benchmark(found: Findings) -> Figure:
    """The page; panels of what was not measured are left out."""
    growth, front = found.details.get("growth", {}), found.details.get("front", [])
    rows = bool(front) + -(-(1 + len(growth)) // 2)
    heights = [6.0] * bool(front) + [4.0] * (rows - bool(front))
    figure = Figure(figsize=(14.0, sum(heights)), layout="constrained")
    axes = iter(figure.subplots(rows, 2, squeeze=False, height_ratios=heights).ravel())
    fronts = [next(axes), next(axes)] if front else []
    _draw_ratios(next(axes), found)
    for axis, measured in growth.items():
        _draw_growth(next(axes), axis, measured)
    for unused in axes:
        unused.set_axis_off()
    if front:
        # names are placed by where the panels are
        figure.draw_without_rendering()
        draw_front(fronts[0], front, "relighting_error", "error of the relit picture, %")
        draw_front(fronts[1], front, "coefficient_error", "error of the coefficients, % of $L_0$")
        for panel in fronts:
            _finish(panel)
    return figure


def _draw_ratios(axes: Axes, found: Findings) -> None:
    chosen = [(stage, found.ratios[key]) for stage in _STAGES if (key := f"{stage}, {HEADLINE}") in found.ratios]
    for row, (_stage, ratio) in enumerate(chosen):
        value = ratio.value
        axes.barh(row, value.median, color=LINE, height=0.6)
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
    for part, colour in (("estimate_ms", LINE), ("relight_ms", PRESET)):
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
