"""The report's chart: coefficients over time with error bands, and where the sheet was tracked."""

import io
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from arlight.fourier import frequency_order
from arlight.results.record import LogHeader, LogRecord

Array = NDArray[np.float64]

# more points than a page is wide only make the file larger
_MOST_POINTS = 400
_BAND_SIGMAS = 2.0
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_STATUS_COLOURS = {"left out": "#b0b0b0", "lost": "#d9534f", "coasting": "#f0ad4e", "tracked": "#5cb85c"}
_CHANNEL_COLOURS = ("#c0392b", "#27ae60", "#2980b9")


def coefficient_chart(header: LogHeader, records: Sequence[LogRecord]) -> str:
    """One panel an order and a strip of the tracking status, as inline SVG."""
    orders = frequency_order(header.frequencies)
    shown = records[:: max(1, -(-len(records) // _MOST_POINTS))]
    times = np.array([record.time_s for record in shown])
    values = np.stack([_padded(record.coefficients, len(orders)) for record in shown])
    sigmas = np.stack([_padded(record.stddev, len(orders)).real for record in shown])
    heights = [0.25, 1.4] + [1.2] * int(orders.max())
    figure = Figure(figsize=(11.0, 1.1 * sum(heights) + 0.6), layout="constrained")
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    _draw_status(axes[0], times, [record.status for record in shown])
    _draw_order_zero(axes[1], times, values[:, 0].real, sigmas[:, 0])
    for order in range(1, int(orders.max()) + 1):
        chosen = orders == order
        # the luminance of channels whose errors are taken as independent
        sigma = np.sqrt((sigmas[:, chosen] ** 2) @ _LUMINANCE**2)
        _draw_order(axes[order + 1], times, values[:, chosen] @ _LUMINANCE, sigma, order)
    axes[-1].set_xlabel("time [s]")
    return _inline_svg(figure)


def _draw_status(axes: Axes, times: Array, statuses: Sequence[str]) -> None:
    names = list(_STATUS_COLOURS)
    row = np.array([[names.index(status) for status in statuses]])
    half = 0.5 * (times[-1] - times[0]) / max(1, len(times) - 1) or 0.5
    axes.imshow(
        row,
        aspect="auto",
        interpolation="nearest",
        cmap=ListedColormap(list(_STATUS_COLOURS.values())),
        vmin=0,
        vmax=len(names) - 1,
        extent=(times[0] - half, times[-1] + half, 0.0, 1.0),
    )
    axes.set_yticks([])
    axes.set_ylabel("sheet", rotation=0, ha="right", va="center")


def _draw_order_zero(axes: Axes, times: Array, values: Array, sigmas: Array) -> None:
    for channel, colour in enumerate(_CHANNEL_COLOURS):
        _draw_line(axes, times, values[:, channel], sigmas[:, channel], colour, 1.2)
    axes.set_ylabel("order 0\n(R, G, B)")


def _draw_order(axes: Axes, times: Array, values: NDArray[np.complex128], sigmas: Array, order: int) -> None:
    palette = mpl.colormaps["tab20"]
    for column in range(values.shape[1]):
        # a coefficient's deviation is that of its real and imaginary part together
        sigma = sigmas[:, column] / np.sqrt(2.0)
        for part, value in enumerate((values[:, column].real, values[:, column].imag)):
            _draw_line(axes, times, value, sigma, palette((2 * column + part) % 20), 0.8)
    axes.axhline(0.0, color="#888", linewidth=0.4)
    axes.set_ylabel(f"order {order}\n(Re, Im)")


def _draw_line(axes: Axes, times: Array, values: Array, sigmas: Array, colour: object, width: float) -> None:
    band = _BAND_SIGMAS * sigmas
    axes.fill_between(times, values - band, values + band, color=colour, alpha=0.15, linewidth=0.0)
    axes.plot(times, values, color=colour, linewidth=width)
    axes.margins(x=0.0)


def _padded(values: NDArray[np.complex128] | Array | None, count: int) -> NDArray[np.complex128]:
    """(count, 3) values, nan where a frame has none."""
    padded = np.full((count, 3), np.nan, complex)
    if values is not None:
        padded[: len(values)] = values
    return padded


def _inline_svg(figure: Figure) -> str:
    text = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "arlight"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    return svg[svg.index("<svg") :]
