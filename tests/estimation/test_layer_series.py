"""Series of printed layers against the print made point by point."""

import numpy as np
import pytest

from arlight.estimation.layer_series import HARMONICS, film_series, paper_series, turned
from arlight.probe.assembly import Print
from arlight.probe.design import Block

ORDERS = np.arange(-HARMONICS, HARMONICS + 1)
PERIOD_MM = 1.3


def block(phase_deg):
    return Block(0, "pattern", (0.0, 0.0), 12.0, 6.0, (2, 1), phase_deg)


def blurred_print(values, sigma_samples):
    """Circular Gaussian blur by explicit summation over many periods."""
    size = len(values)
    reach = np.arange(-3 * size, 3 * size + 1)
    kernel = np.exp(-0.5 * (reach / sigma_samples) ** 2)
    kernel /= kernel.sum()
    return np.array([np.sum(kernel * values[(i + reach) % size]) for i in range(size)])


@pytest.mark.parametrize("design", ["matched", "doubled"])
@pytest.mark.parametrize("phase_deg", [0.0, 90.0, 215.0])
def test_series_are_the_toned_and_blurred_print(design, phase_deg):
    made = Print(blur_mm=0.11, dot_gain=0.12, solid=0.05)
    psi = np.arange(400) * 2 * np.pi / 400
    tau = np.radians(phase_deg)
    film, paper = (
        (0.5 + 0.5 * np.cos(psi), 0.5 + 0.5 * np.cos(psi + tau))
        if design == "matched"
        else (0.5 - 0.5 * np.sin(psi), 0.5 + 0.5 * np.sin(2 * psi + tau))
    )
    cycles = np.array([[0.6, 0.8]]) / PERIOD_MM
    analysis = np.exp(-1j * np.outer(ORDERS, psi)) / len(psi)
    for series, values in ((film_series, film), (paper_series, paper)):
        covered = 1 - values
        grown = covered + 4 * 0.12 * covered * (1 - covered)
        printed = blurred_print(0.05 + 0.95 * (1 - grown), 0.11 / PERIOD_MM * 400)
        np.testing.assert_allclose(series((block(phase_deg),), design, made, cycles)[0], analysis @ printed, atol=1e-9)


def test_turning_is_a_shift_of_the_pattern():
    series = paper_series((block(0.0),), "matched", Print(), np.zeros((1, 2)))
    ahead = paper_series((block(40.0),), "matched", Print(), np.zeros((1, 2)))
    np.testing.assert_allclose(turned(series, np.radians([40.0])), ahead, atol=1e-15)
