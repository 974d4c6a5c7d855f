"""The front as a picture: every point, the line of those that nothing beats, names where there is room."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

PRESET, POINT, LINE = "#c1440e", "#7a8a99", "#2b4c6f"

_TICKS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
_WIDTH_SHARE = 0.63
"""Mean width of a letter, relative to the size of the type."""
_GAP_PT = 5.0
_MARKER_PT = 4.0


@dataclass(frozen=True, slots=True)
class _Box:
    """A rectangle of the panel that is taken [pt]."""

    x0: float
    y0: float
    x1: float
    y1: float

    def meets(self, other: "_Box") -> bool:
        return self.x0 < other.x1 and other.x0 < self.x1 and self.y0 < other.y1 and other.y0 < self.y1

    def within(self, other: "_Box") -> bool:
        return self.x0 >= other.x0 and self.y0 >= other.y0 and self.x1 <= other.x1 and self.y1 <= other.y1


def draw_front(axes: Axes, points: Sequence[dict[str, Any]], error: str, label: str) -> None:
    """One error of all points over their cost.

    Args:
        axes: the panel.
        points: as `measure_front` tells them.
        error: key of the error.
        label: what the error is, in words.
    """
    shown = [point for point in points if point[error] is not None and np.isfinite(point[error])]
    places = {point["name"]: (point["cost_ms"]["median"], 100.0 * point[error]) for point in shown}
    best = {point["name"] for point in shown if _unbeaten(places[point["name"]], list(places.values()))}
    along = sorted(places[name] for name in best)
    axes.step(*zip(*along, strict=True), where="post", color=LINE, linewidth=1.2, zorder=1)
    for point in shown:
        if point["is_preset"]:
            axes.scatter(*places[point["name"]], s=70, color=PRESET, marker="D", zorder=3)
        else:
            axes.scatter(*places[point["name"]], s=26, color=LINE if point["name"] in best else POINT, zorder=2)
    _scale(axes, label)
    ranked = sorted(shown, key=lambda point: (not point["is_preset"], point["name"] not in best))
    _name(axes, [(point["name"], places[point["name"]], point["is_preset"]) for point in ranked])


def _unbeaten(place: tuple[float, float], others: Sequence[tuple[float, float]]) -> bool:
    return not any(x <= place[0] and y <= place[1] and (x, y) != place for x, y in others)


def _scale(axes: Axes, label: str) -> None:
    axes.set_xlabel("CPU time a frame, tracking to composite, ms")
    axes.set_ylabel(label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.12, y=0.1)
    axes.autoscale_view()
    for scale in (axes.xaxis, axes.yaxis):
        scale.set_major_locator(LogLocator(subs=_TICKS))
        scale.set_major_formatter(StrMethodFormatter("{x:g}"))
        scale.set_minor_formatter(NullFormatter())


def _name(axes: Axes, named: Sequence[tuple[str, tuple[float, float], bool]]) -> None:
    """Names beside the points, the first ones first; what has no room goes without."""
    size_pt = np.array(axes.get_window_extent().size) * 72.0 / axes.figure.dpi
    panel = _Box(0.0, 0.0, *size_pt)
    spots = {name: _spot_pt(axes, place, size_pt) for name, place, _ in named}
    taken = [_Box(x - _MARKER_PT, y - _MARKER_PT, x + _MARKER_PT, y + _MARKER_PT) for x, y in spots.values()]
    for name, place, preset in named:
        type_pt, (x, y) = (9.0 if preset else 7.0), spots[name]
        around = _around(_WIDTH_SHARE * type_pt * len(name), 1.1 * type_pt)
        boxes = [_Box(x + dx, y + dy, x + dx + width, y + dy + height) for dx, dy, width, height in around]
        free = [box for box in boxes if box.within(panel) and not any(box.meets(other) for other in taken)]
        if free:
            taken.append(free[0])
            offset, weight = (free[0].x0 - x, free[0].y0 - y), "bold" if preset else "normal"
            axes.annotate(name, place, xytext=offset, textcoords="offset points", fontsize=type_pt, fontweight=weight)


def _around(width: float, height: float) -> list[tuple[float, float, float, float]]:
    """Places of a name about its point, as offset and size [pt], the best first."""
    across = (_GAP_PT, -_GAP_PT - width, -width / 2.0)
    along = (-height / 2.0, _GAP_PT, -_GAP_PT - height)
    places = [(dx, dy) for dx in across for dy in along if (dx, dy) != (across[2], along[0])]
    return [(dx, dy, width, height) for dx, dy in places]


def _spot_pt(axes: Axes, place: tuple[float, float], size_pt: np.ndarray) -> tuple[float, float]:
    """Where a point is in the panel [pt]."""
    share = axes.transAxes.inverted().transform(axes.transData.transform(place))
    return float(share[0] * size_pt[0]), float(share[1] * size_pt[1])
