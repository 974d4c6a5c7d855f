"""What a calibration finds out about the layers, as a vector with names, priors and limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.probe.assembly import Assembly, Print, Registration

Array = NDArray[np.float64]

_BLUR_MM = 0.08
"""Usual blur of a print, squared below."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One unknown of the layers."""

    name: str
    """Name in the report and in the calibration's file."""
    expected: float
    """Prior mean: as designed."""
    stddev: float
    """Prior standard deviation: what hands, printers and glaziers do."""
    step: float
    """Step over which the response is linear."""
    low: float = -np.inf
    """Least possible value."""
    high: float = np.inf
    """Greatest possible value."""


def _of_print(layer: str) -> tuple[Parameter, ...]:
    return (
        Parameter(f"{layer}.shift_x_mm", 0.0, 0.5, 1e-3, -20.0, 20.0),
        Parameter(f"{layer}.shift_y_mm", 0.0, 0.5, 1e-3, -20.0, 20.0),
        Parameter(f"{layer}.rotation_deg", 0.0, 0.5, 1e-3, -5.0, 5.0),
        Parameter(f"{layer}.scale", 1.0, 0.003, 1e-5, 0.9, 1.1),
        # the response is linear in the blur's variance, and nearly flat in its root
        Parameter(f"{layer}.blur_variance_mm2", 0.0, 2.0 * _BLUR_MM**2, 1e-4, 0.0, 0.25),
        Parameter(f"{layer}.dot_gain", 0.0, 0.1, 1e-3, -0.2, 0.24),
        Parameter(f"{layer}.solid", 0.0, 0.03, 1e-4, 0.0, 0.5),
    )


PARAMETERS = (
    *_of_print("film"),
    *_of_print("paper"),
    Parameter("glass_scale", 1.0, 0.02, 1e-4, 0.8, 1.25),
    Parameter("reflectance", 1.0, 0.1, 1e-3, 0.3, 3.0),
    Parameter("lower_face", 1.0, 0.5, 1e-2, 0.0, 1.5),
)
"""The unknown of the layers, in the order of the vector."""
NAMES = tuple(parameter.name for parameter in PARAMETERS)
EXPECTED = np.array([parameter.expected for parameter in PARAMETERS])
STDDEV = np.array([parameter.stddev for parameter in PARAMETERS])
STEPS = np.array([parameter.step for parameter in PARAMETERS])
REFLECTANCE, LOWER_FACE = NAMES.index("reflectance"), NAMES.index("lower_face")

_PER_PRINT = len(_of_print(""))


def within_limits(values: Array) -> Array:
    """The vector with impossible values moved to the nearest possible ones."""
    return np.clip(values, [parameter.low for parameter in PARAMETERS], [parameter.high for parameter in PARAMETERS])


def assembly_of(values: Array) -> Assembly:
    """The layers (without blocks' corrections, reflectance and lower face) that a vector describes."""
    return Assembly(
        film=_print(values[:_PER_PRINT]),
        paper=_print(values[_PER_PRINT : 2 * _PER_PRINT]),
        glass_scale=float(values[2 * _PER_PRINT]),
    )


def values_of(assembly: Assembly) -> Array:
    """The vector of an assembly, with the expected reflectance and lower face."""
    values = EXPECTED.copy()
    values[:_PER_PRINT] = _print_values(assembly.film)
    values[_PER_PRINT : 2 * _PER_PRINT] = _print_values(assembly.paper)
    values[2 * _PER_PRINT] = assembly.glass_scale
    return within_limits(values)


def _print(values: Array) -> Print:
    x, y, rotation, scale, variance, gain, solid = (float(value) for value in values)
    return Print(Registration((x, y), rotation, scale), float(np.sqrt(max(variance, 0.0))), gain, max(solid, 0.0))


def _print_values(layer: Print) -> Array:
    placed = layer.registration
    return np.array(
        [*placed.shift_mm, placed.rotation_deg, placed.scale, layer.blur_mm**2, layer.dot_gain, layer.solid]
    )
