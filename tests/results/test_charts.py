"""The chart of coefficients: one panel an order, every status with its colour, well-formed SVG."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from arlight.camera import Camera
from arlight.fourier import half_plane_frequencies
from arlight.optics import Slab
from arlight.results.charts import coefficient_chart
from arlight.results.record import LogHeader, LogRecord

CAMERA = Camera((64, 48), [[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]], np.zeros(5))


def chart(order: int, frames: int, status=lambda _frame: "tracked") -> str:
    frequencies = half_plane_frequencies(order)
    rng = np.random.default_rng(5)
    records = []
    for frame in range(frames):
        values = rng.normal(size=(len(frequencies), 3)) * (1 + 1j)
        known = status(frame) != "lost"
        records.append(
            LogRecord(
                frame,
                frame / 30,
                status(frame),
                None,
                0.1,
                values if known else None,
                np.abs(values) if known else None,
                order,
                1.0,
                {},
            )
        )
    return coefficient_chart(LogHeader(frequencies, CAMERA, Slab(), (9.0, 9.0), "c", "p"), records)


@pytest.mark.parametrize("order", [1, 3, 5])
def test_a_panel_for_every_order(order):
    svg = chart(order, 5)
    ElementTree.fromstring(svg)
    for number in range(order + 1):
        assert f"order {number}" in svg
    assert f"order {order + 1}" not in svg


@pytest.mark.parametrize("frames", [1, 2])
def test_the_shortest_clips_have_a_chart(frames):
    assert ElementTree.fromstring(chart(2, frames)).tag.endswith("svg")


def test_frames_without_an_estimate_leave_gaps():
    picture = ElementTree.fromstring(chart(2, 6, status=lambda frame: "lost" if frame < 3 else "coasting"))
    assert picture.tag.endswith("svg")


def test_a_long_clip_does_not_make_a_long_page():
    assert len(chart(1, 4000)) < 3 * len(chart(1, 400))
