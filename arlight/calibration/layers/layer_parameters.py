"""What self-calibration solves for: the assembled sheet and the vignetting, as one vector of named numbers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.probe.assembly import Assembly, Print, Registration

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One unknown of the sheet."""

    name: str
    """What it is, with its unit."""
    expected: float
    """Value before anything is measured: the design's."""
    stddev: float
    """Standard deviation of what hands, printers and glaziers make of it."""
    step: float
    """Step of its numerical derivative."""
    low: float = -np.inf
    """Least value that means something."""
    high: float = np.inf
    """Greatest one."""


PARAMETERS = (
    Parameter("film_x_mm", 0.0, 0.3, 0.005),
    Parameter("film_y_mm", 0.0, 0.3, 0.005),
    Parameter("film_rotation_deg", 0.0, 0.4, 0.01),
    Parameter("film_scale", 1.0, 0.002, 1e-4, 0.9, 1.1),
    Parameter("paper_x_mm", 0.0, 0.3, 0.005),
    Parameter("paper_y_mm", 0.0, 0.3, 0.005),
    Parameter("paper_rotation_deg", 0.0, 0.4, 0.01),
    Parameter("paper_scale", 1.0, 0.002, 1e-4, 0.9, 1.1),
    Parameter("glass_scale", 1.0, 0.05, 1e-3, 0.6, 1.8),
    # variances: blur acts through them, and they have no kink at zero
    Parameter("film_blur_mm2", 0.003, 0.01, 3e-4, 0.0),
    Parameter("paper_blur_mm2", 0.003, 0.01, 3e-4, 0.0),
    Parameter("film_dot_gain", 0.0, 0.08, 2e-3, -0.2, 0.24),
    Parameter("paper_dot_gain", 0.0, 0.08, 2e-3, -0.2, 0.24),
    Parameter("film_solid", 0.01, 0.02, 2e-3, 0.0, 0.5),
    Parameter("paper_solid", 0.02, 0.03, 2e-3, 0.0, 0.5),
    Parameter("vignetting_k1", 0.0, 0.15, 1e-2),
    Parameter("vignetting_k2", 0.0, 0.05, 1e-2),
    Parameter("lower_face", 1.0, 0.5, 0.05, 0.0),
    Parameter("gradient_x", 0.0, 0.01, 1e-3),
    Parameter("gradient_y", 0.0, 0.01, 1e-3),
)
NAMES = tuple(parameter.name for parameter in PARAMETERS)
EXPECTED = np.array([parameter.expected for parameter in PARAMETERS])
STDDEV = np.array([parameter.stddev for parameter in PARAMETERS])
STEP = np.array([parameter.step for parameter in PARAMETERS])
LOW = np.array([parameter.low for parameter in PARAMETERS])
HIGH = np.array([parameter.high for parameter in PARAMETERS])


def assembly_of(vector: Array) -> Assembly:
    """The assembled sheet that a vector of the parameters (p,) describes."""
    p = dict(zip(NAMES, map(float, vector), strict=True))
    return Assembly(film=_print("film", p), paper=_print("paper", p), glass_scale=p["glass_scale"])


def vector_of(assembly: Assembly) -> Array:
    """The parameters (p,) of an assembled sheet; what an assembly does not hold is as expected."""
    vector = EXPECTED.copy()
    for name, layer in (("film", assembly.film), ("paper", assembly.paper)):
        place = layer.registration
        values = {
            "x_mm": place.shift_mm[0],
            "y_mm": place.shift_mm[1],
            "rotation_deg": place.rotation_deg,
            "scale": place.scale,
            "blur_mm2": layer.blur_mm**2,
            "dot_gain": layer.dot_gain,
            "solid": layer.solid,
        }
        for key, value in values.items():
            vector[NAMES.index(f"{name}_{key}")] = value
    vector[NAMES.index("glass_scale")] = assembly.glass_scale
    return vector


def _print(layer: str, p: dict[str, float]) -> Print:
    shift = (p[f"{layer}_x_mm"], p[f"{layer}_y_mm"])
    return Print(
        Registration(shift, p[f"{layer}_rotation_deg"], p[f"{layer}_scale"]),
        float(np.sqrt(max(p[f"{layer}_blur_mm2"], 0.0))),
        p[f"{layer}_dot_gain"],
        max(p[f"{layer}_solid"], 0.0),
    )
