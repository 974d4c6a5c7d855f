"""Self-calibration: the assembled sheet from a camera that moves over it under unknown, constant light.

What the paper's stripes add to the film's shifts with the view in a way that no light can imitate, so a few seconds of
motion tell where the layers lie, how thick the glass is and what the printer made of the patterns.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.layers.layer_fit import LayerFit, LayerSolution
from arlight.calibration.layers.layer_parameters import EXPECTED, NAMES, STDDEV, assembly_of
from arlight.calibration.layers.sheet_blocks import coarse_part
from arlight.calibration.layers.sheet_view import SheetView
from arlight.calibration.layers.view_measurement import SeenSheet, ViewMeter, light_plane_points, varied
from arlight.camera import Camera
from arlight.errors import CalibrationError
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe

Array = NDArray[np.float64]

VIEWS = 20
"""Views that are measured; more add little, for the errors of codecs and models repeat from view to view."""
_LEAST_VIEWS = 4
_LEAST_SPREAD = 0.015
"""Rms distance of the views from their mean on the light plane, whose disk has radius 1/2; 0.015 is about 4 degrees."""
_ORDERS = (1, 2, 3)
"""Coarse stripes are fitted first: fine ones repeat within what a hand may misplace."""
_NEARLY_SETTLED = 1.0
"""Where a fit stops that only leads to the next one; as `SETTLED`."""
_DETERMINED = 0.5
"""Share of its prior deviation that a parameter's deviation must fall below to count as measured."""
_NECESSARY = ("paper_x_mm", "paper_y_mm", "glass_scale")


@dataclass(frozen=True, slots=True)
class SelfCalibration:
    """What the motion told."""

    assembly: Assembly
    """The sheet as it is."""
    vignetting: tuple[float, float, float]
    """Radial gain of the camera's lens beside what its file already had."""
    values: dict[str, float]
    """Every parameter by name."""
    stddev: dict[str, float]
    """Its standard deviation."""
    undetermined: tuple[str, ...]
    """Parameters about which the views told little."""
    views: int
    """How many views were used."""
    chi2: float
    """Robust chi-square a row; about 1 or below when the model describes the sheet."""


Progress = Callable[[int, int], None]
"""Called with steps done and steps in all."""


def self_calibrate(
    seen: Sequence[SeenSheet], probe: Probe, camera: Camera, progress: Progress = lambda _done, _total: None
) -> SelfCalibration:
    """Estimate the assembled sheet from frames of it under constant light.

    Args:
        seen: frames that show the sheet from many sides.
        probe: the sheet as designed; its paper's reflectance sets the light's absolute scale.
        camera: the camera, with distortion; vignetting is estimated beside what it has.

    Returns:
        The assembly with uncertainties; film and paper in the probe frame.

    Raises:
        CalibrationError: too few views, or views too much alike to tell the layers from the light.
    """
    _check_motion(seen, probe)
    chosen = varied(seen, probe, VIEWS)
    orders = [order for order in _ORDERS if order < probe.order]
    total = 2 * len(chosen) + len(orders) + 2
    done = 0

    def measured(assembly: Assembly) -> list[SheetView]:
        nonlocal done
        meter, views = ViewMeter(probe, camera, assembly), []
        for view in chosen:
            views.append(meter.measure(view))
            progress(done := done + 1, total)
        return views

    vector = EXPECTED
    views = measured(Assembly())
    for order in [*orders, probe.order]:
        vector = LayerFit(*coarse_part(probe, views, order)).solve(vector, _NEARLY_SETTLED).vector
        progress(done := done + 1, total)
    # again with the film where it was found
    solution = LayerFit(probe, measured(assembly_of(vector))).solve(vector)
    progress(total, total)
    return _result(solution, len(chosen))


def _result(solution: LayerSolution, views: int) -> SelfCalibration:
    # errors of codec and model repeat from view to view, so views do not average them
    deviation = np.sqrt(np.diagonal(solution.covariance) * views * max(solution.chi2, 0.1))
    deviation = np.minimum(deviation, STDDEV)
    values = dict(zip(NAMES, map(float, solution.vector), strict=True))
    undetermined = tuple(name for name, d, s in zip(NAMES, deviation, STDDEV, strict=True) if d > _DETERMINED * s)
    if missing := [name for name in _NECESSARY if name in undetermined]:
        raise CalibrationError(
            f"the views do not tell {', '.join(missing)} from the light ({views} views were used); move the camera "
            "further around and over the sheet, by 30 degrees or more in both directions, with the whole sheet sharp "
            "in the picture"
        )
    return SelfCalibration(
        assembly=assembly_of(solution.vector),
        vignetting=(values["vignetting_k1"], values["vignetting_k2"], 0.0),
        values=values,
        stddev=dict(zip(NAMES, map(float, deviation), strict=True)),
        undetermined=undetermined,
        views=views,
        chi2=solution.chi2,
    )


def _check_motion(seen: Sequence[SeenSheet], probe: Probe) -> None:
    if len(seen) < _LEAST_VIEWS:
        raise CalibrationError(
            f"the sheet was found in {len(seen)} frames; self-calibration needs {_LEAST_VIEWS} or more from different "
            "sides: film a few seconds while moving over the sheet, all of it in the picture"
        )
    points = light_plane_points(seen, probe)
    spread = float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))
    if spread < _LEAST_SPREAD:
        raise CalibrationError(
            f"the camera hardly moved around the sheet: its directions spread by {spread:.3f} on the light plane, and "
            f"{_LEAST_SPREAD} are needed, about 4 degrees; film a few seconds while moving around and over the sheet"
        )
