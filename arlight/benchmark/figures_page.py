"""The page of figures: coefficients side by side, and light as disks of the light plane."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from arlight.benchmark.figures import Complex, LightFigure
from arlight.environment import Environment
from arlight.fourier import frequency_order, synthesise

Array = NDArray[np.float64]

# Okabe and Ito's palette
SHEET_COLOR, BALL_COLOR, TRUTH_COLOR = "#0072B2", "#E69F00", "#000000"
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_DISK_PIXELS = 181
_LOW_ORDER = 2
"""Highest order of the coefficients that are told one by one."""
_GAMMA = 2.2
_INK = "#222222"


def draw_figures(figures: Sequence[LightFigure]) -> Figure:
    """The paper's figures 6 and 7, one row a light, and figure 8 below.

    Args:
        figures: one or more lights.
    """
    order = figures[0].estimate.order
    heights = [2.9] * len(figures) + [2.3 * len(figures) + 0.8]
    page = Figure(figsize=(12.0, sum(heights) + 0.5), layout="constrained", facecolor="white")
    page.suptitle(
        f"Light by the planar sheet (one 8-bit picture, order {order}) and by a mirrored ball (bracketed pictures)",
        fontsize=13,
        color=_INK,
    )
    parts = page.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    for number, (part, figure) in enumerate(zip(parts[:-1], figures, strict=True)):
        _draw_light(part, figure, f"Figure {6 + number}" if number < 2 else "Another light")
    _draw_higher_orders(parts[-1], figures)
    return page


def _draw_light(part: SubFigure, figure: LightFigure, title: str) -> None:
    """Photograph, coefficients and disks of one light."""
    grid = part.add_gridspec(2, 5, width_ratios=[2.0, 2.4, 1.0, 1.0, 1.0])
    part.suptitle(f"{title}: {figure.name}", fontsize=11, x=0.01, ha="left", color=_INK)
    photograph = part.add_subplot(grid[:, 0])
    width = figure.photograph.shape[1]
    # the table left of the sheet is empty
    photograph.imshow(figure.photograph[:, width // 5 :])
    photograph.set_title("what the camera saw", fontsize=9)
    photograph.set_axis_off()
    real, imaginary = part.add_subplot(grid[0, 1]), part.add_subplot(grid[1, 1])
    _draw_coefficients(real, figure, "real")
    _draw_coefficients(imaginary, figure, "imaginary")
    real.legend(fontsize=7, loc="upper right", frameon=False, ncols=3)
    real.tick_params(labelbottom=False)
    imaginary.set_xlabel("frequency (u, v)", fontsize=8)
    estimated = _series(figure, figure.estimate.coefficients, 1)
    approximated = _series(figure, figure.ball, 1)
    scale = float(np.nanmax(approximated))
    disks = (
        ("sheet's estimate,\norder 1", estimated),
        ("ball's light,\norder 1", approximated),
        ("ball's light", _received(figure, figure.ball_environment)),
    )
    for column, (label, disk) in enumerate(disks, start=2):
        _draw_disk(part.add_subplot(grid[:, column]), disk, scale, label)


def _draw_coefficients(axes: Axes, figure: LightFigure, part: str) -> None:
    """Coefficients up to the low order, luminance relative to L~_0, estimate beside the ball's."""
    frequencies = figure.estimate.frequencies
    chosen = frequency_order(frequencies) <= _LOW_ORDER
    level = float(figure.truth[0].real @ _LUMINANCE)
    place = np.arange(np.count_nonzero(chosen))
    deviation = np.sqrt(figure.estimate.stddev[chosen] ** 2 @ _LUMINANCE**2) / level / np.sqrt(2.0)
    for shift, coefficients, color, label in (
        (-0.17, figure.estimate.coefficients, SHEET_COLOR, "sheet (bar: 2 sigma)"),
        (0.17, figure.ball, BALL_COLOR, "mirrored ball"),
    ):
        value = coefficients[chosen] @ _LUMINANCE / level
        height = value.real if part == "real" else value.imag
        axes.bar(place + shift, height, 0.32, color=color, label=label)
        if color == SHEET_COLOR:
            axes.errorbar(place + shift, height, 2.0 * deviation, fmt="none", ecolor=_INK, elinewidth=0.9, capsize=1.5)
    true = figure.truth[chosen] @ _LUMINANCE / level
    shown = true.real if part == "real" else true.imag
    axes.hlines(shown, place - 0.36, place + 0.36, color=TRUTH_COLOR, linewidth=1.0, label="true")
    axes.axhline(0.0, color="#888888", linewidth=0.6)
    axes.set_xticks(place, [f"{u},{v}" for u, v in frequencies[chosen]], fontsize=7)
    axes.tick_params(axis="y", labelsize=7)
    axes.set_ylabel(f"{part} / $L_0$", fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    top = 1.55 if part == "real" else max(0.1, 1.15 * float(np.abs(true.imag).max()))
    axes.set_ylim(min(-0.05, 1.3 * float(shown.min())) if part == "real" else -top, top)


def _draw_higher_orders(part: SubFigure, figures: Sequence[LightFigure]) -> None:
    """Figure 8: each light order by order, sheet below ball, and the error of every order."""
    top = figures[0].estimate.order
    orders = list(range(2, top + 1)) or [1]
    part.suptitle("Figure 8: higher orders", fontsize=11, x=0.01, ha="left", color=_INK)
    grid = part.add_gridspec(2 * len(figures), len(orders) + 2, width_ratios=[1.0] * (len(orders) + 1) + [2.2])
    for row, figure in enumerate(figures):
        actual = _received(figure, figure.ball_environment)
        scale = float(np.nanmax(_series(figure, figure.ball, top))) * 0.8
        for column, order in enumerate(orders):
            pairs = ((figure.ball, "ball"), (figure.estimate.coefficients, "sheet"))
            for below, (coefficients, source) in enumerate(pairs):
                axes = part.add_subplot(grid[2 * row + below, column])
                title = f"order {order}" if row == 0 and below == 0 else ""
                _draw_disk(axes, _series(figure, coefficients, order), scale, title)
                if column == 0:
                    axes.text(-0.72, 0.0, f"{figure.name}\n{source}", ha="right", va="center", fontsize=9)
        title = "all orders" if row == 0 else ""
        _draw_disk(part.add_subplot(grid[2 * row : 2 * row + 2, len(orders)]), actual, scale, title)
    _draw_errors(part.add_subplot(grid[:, -1]), figures)


def _draw_errors(axes: Axes, figures: Sequence[LightFigure]) -> None:
    """Error of each order against the true light, one mark a light."""
    markers = "os^Dv"
    for number, figure in enumerate(figures):
        for coefficients, color, source in (
            (figure.estimate.coefficients, SHEET_COLOR, "sheet"),
            (figure.ball, BALL_COLOR, "ball"),
        ):
            errors = 100.0 * figure.errors(coefficients)
            axes.plot(
                np.arange(len(errors)),
                errors,
                color=color,
                marker=markers[number % len(markers)],
                linestyle="-" if source == "sheet" else "--",
                linewidth=1.2,
                markersize=5,
                label=f"{source}, {figure.name}",
            )
    axes.set_xlabel("order", fontsize=9)
    axes.set_ylabel("error against the true light, % of $|L_0|$", fontsize=9)
    axes.set_xticks(np.arange(figures[0].estimate.order + 1))
    axes.set_ylim(bottom=0.0)
    axes.tick_params(labelsize=8)
    axes.grid(axis="y", linewidth=0.4, color="#cccccc")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8, frameon=False)


def _draw_disk(axes: Axes, light: Array, scale: float, title: str) -> None:
    """Received light on the light plane; nan outside the disk."""
    encoded = np.clip(np.nan_to_num(light, nan=0.0) / max(scale, 1e-12), 0.0, 1.0) ** (1.0 / _GAMMA)
    opaque = np.isfinite(light[..., :1]).astype(float)
    axes.imshow(np.concatenate([encoded, opaque], axis=-1), extent=(-0.5, 0.5, -0.5, 0.5), interpolation="bilinear")
    axes.set_title(title, fontsize=9, color=_INK)
    axes.set_axis_off()


def _plane() -> tuple[Array, NDArray[np.bool_]]:
    """Coordinates (n, n, 2) of the light plane, row 0 at the top, and which lie in the disk."""
    steps = (np.arange(_DISK_PIXELS) + 0.5) / _DISK_PIXELS - 0.5
    plane = np.stack(np.meshgrid(steps, -steps), axis=-1)
    return plane, np.linalg.norm(plane, axis=-1) < 0.5


def _series(figure: LightFigure, coefficients: Complex, order: int) -> Array:
    """Received light of the coefficients up to an order on the light plane (n, n, 3)."""
    plane, inside = _plane()
    frequencies = figure.estimate.frequencies
    kept = frequency_order(frequencies) <= order
    disk = np.full((*inside.shape, 3), np.nan)
    disk[inside] = synthesise(coefficients[kept], plane[inside], frequencies[kept])
    return disk


def _received(figure: LightFigure, environment: Environment) -> Array:
    """Received light of an environment on the light plane (n, n, 3)."""
    plane, inside = _plane()
    disk = np.full((*inside.shape, 3), np.nan)
    at = plane[inside]
    disk[inside] = environment.radiance_at(figure.slab.directions(at)) * figure.slab.received_weight(at)[:, None]
    return disk
