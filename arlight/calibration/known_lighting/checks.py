"""Whether known lights are fit to calibrate with: different enough, and those under which the frames were taken."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.known_lighting.lit_views import measure
from arlight.calibration.known_lighting.sheet_model import Unknowns
from arlight.calibration.layers.view_measurement import SeenSheet
from arlight.camera import Camera
from arlight.errors import CalibrationError
from arlight.estimation.estimator import LightingEstimator
from arlight.estimation.nuisance import Nuisance
from arlight.fourier import frequency_order, unpack_real
from arlight.probe.design import Probe

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LEAST_LIGHTINGS = 2
_ALIKE = 0.02
"""Second singular value of the lights' coefficients, relative to the first, below which they are one light."""
_MISMATCH = 0.12
"""Error of orders 1 and 2 in green, relative to L~_0, that only frames under another light have."""
_BRIGHTNESS_MISMATCH = 0.3
"""The same for order 0 where exposures are known: that the sheet's own gain is this far off is hardly possible."""
_HINT = 0.6
"""A better match is named where its error is below this share."""
_YAWS = 24


@dataclass(frozen=True, slots=True)
class LightingError:
    """How well one lighting is estimated by a calibration that has not seen it."""

    name: str
    """The lighting."""
    orders: Array
    """(order + 1,) median over its views of each order's error, relative to |L~_0|."""
    shape: float
    """Median over its views of the error of orders 1 and 2 in green, estimate and light scaled to L~_0 = 1."""
    estimate: ComplexArray
    """(k, 3) the coefficients that its first view told."""


def condition_number(lights: Sequence[KnownLight], probe: Probe) -> tuple[float, float]:
    """Singular values of the lights' coefficients L (paper: L = M V), every light scaled to L~_0 = 1.

    Returns:
        largest over smallest, infinite where a light is a mixture of the others; second over largest.
    """
    relative = np.stack([_relative(light, probe) for light in lights], axis=1)
    values = np.linalg.svd(relative, compute_uv=False)
    smallest = values[-1] if values[-1] > 1e-9 * values[0] else 0.0
    return float(values[0] / smallest) if smallest else float("inf"), float(values[min(1, len(values) - 1)] / values[0])


def check_lights(lights: Sequence[KnownLight], seen: Sequence[SeenSheet], probe: Probe) -> None:
    """Refuse lights that cannot calibrate.

    Raises:
        CalibrationError: fewer than two lightings, a lighting whose frames do not show the sheet, or lights all alike.
    """
    if len(lights) < LEAST_LIGHTINGS:
        raise CalibrationError(
            f"{len(lights)} known lighting was given; calibration needs {LEAST_LIGHTINGS} or more that differ: give "
            "frames under other lights with their environments, or turn the sheet under the same light"
        )
    for number, light in enumerate(lights):
        if not any(frame.light == number for frame in seen):
            raise CalibrationError(
                f"{light.name}: none of its frames shows the sheet; give pictures in which the whole sheet is sharp "
                "and its markers are at least 15 pixels wide"
            )
        if not light.packed(probe.frequencies[:1])[0].min() > 0.0:
            raise CalibrationError(
                f"{light.name}: its environment is black above the horizon in at least one channel; check that its "
                "first row is the zenith"
            )
    _, spread = condition_number(lights, probe)
    if spread < _ALIKE:
        raise CalibrationError(
            f"all {len(lights)} lightings are the same light but for their brightness (second singular value "
            f"{spread:.3f} of the first, {_ALIKE} is needed); turn the sheet, or add frames under another light"
        )


def lighting_error(
    light: KnownLight,
    seen: Sequence[SeenSheet],
    probe: Probe,
    camera: Camera,
    unknowns: Unknowns,
    exposure: Array,
) -> LightingError:
    """Estimate the views of one lighting with a calibration, and compare with the light.

    Args:
        light: the truth.
        seen: its frames.
        probe: the sheet as designed.
        camera: the camera, the calibration's vignetting included.
        unknowns: the calibration.
        exposure: (3,) factor on the light's radiance.
    """
    assembly = unknowns.assembly
    estimator = LightingEstimator(probe, assembly)
    truth = unpack_real(light.packed(probe.frequencies) * exposure)
    own = [replace(frame, light=0) for frame in seen]
    stripes = None
    nuisances = [Nuisance.guess(frame.pose.blur_px**2) for frame in own]
    for _ in range(2):
        views = measure(own, [light], probe, camera, assembly, stripes)
        estimates = [
            estimator.estimate(view.sheet.means, 0.0, nuisance) for view, nuisance in zip(views, nuisances, strict=True)
        ]
        stripes = [estimate.stripes for estimate in estimates]
        nuisances = [estimate.nuisance for estimate in estimates]
    found = [estimate.lighting.coefficients for estimate in estimates]
    errors = [order_errors(coefficients, truth, probe.frequencies) for coefficients in found]
    shapes = [_shape_error(coefficients, truth, probe.frequencies) for coefficients in found]
    return LightingError(light.name, np.median(errors, axis=0), float(np.median(shapes)), found[0])


def order_errors(found: ComplexArray, truth: ComplexArray, frequencies: NDArray[np.int64]) -> Array:
    """(order + 1,) rms over each order's coefficients and channels of |found - truth|, relative to |L~_0|."""
    squared = np.mean(np.abs(found - truth) ** 2, axis=1)
    level = np.sqrt(np.mean(np.abs(truth[0]) ** 2))
    order = frequency_order(frequencies)
    return np.array([np.sqrt(squared[order == o].mean()) for o in range(int(order.max()) + 1)]) / level


def check_match(errors: Sequence[LightingError], lights: Sequence[KnownLight], probe: Probe, relative: bool) -> None:
    """Refuse environments that are not those of their frames.

    Raises:
        CalibrationError: names the pair that fits worst, and what its frames look like instead.
    """
    low = [error.shape for error in errors]
    worst = int(np.argmax(low))
    if low[worst] > _MISMATCH:
        raise CalibrationError(
            f"{errors[worst].name}: the environment does not match its frames: the light that they show differs from "
            f"it by {100.0 * low[worst]:.0f} % in orders 1 and 2 (up to {100.0 * _MISMATCH:.0f} % can be the "
            f"calibration's error){_hint(errors[worst], low[worst], worst, lights, probe)}; give every frames entry "
            "the environment that lit it, in the same place of the list, and its yaw in the sheet's frame"
        )
    if relative:
        return
    off = [float(error.orders[0]) for error in errors]
    worst = int(np.argmax(off))
    if off[worst] > _BRIGHTNESS_MISMATCH:
        raise CalibrationError(
            f"{errors[worst].name}: the environment's brightness differs from its frames' by {100.0 * off[worst]:.0f} "
            "%; scale the environments so that 1 is the camera's full scale (--exposures), or calibrate with "
            "--relative, which leaves every light's brightness open"
        )


def _hint(error: LightingError, own: float, number: int, lights: Sequence[KnownLight], probe: Probe) -> str:
    """What the frames look like instead, where something fits much better."""
    shown = error.estimate[:, 1] / max(abs(error.estimate[0, 1]), 1e-9)
    for other, light in enumerate(lights):
        if other != number and _distance(shown, light, probe) < _HINT * own:
            return f"; its frames look like those of {light.name}"
    light = lights[number]
    yaws = 2.0 * np.pi * np.arange(1, _YAWS) / _YAWS
    turned = [
        _distance(shown, replace(light, environment=light.environment.rotated(float(yaw))), probe) for yaw in yaws
    ]
    if min(turned) < _HINT * own:
        degrees = (np.rad2deg(yaws[int(np.argmin(turned))]) + 180.0) % 360.0 - 180.0
        return f"; turned by another {degrees:+.0f} degrees it would match"
    return ""


def _shape_error(found: ComplexArray, truth: ComplexArray, frequencies: NDArray[np.int64]) -> float:
    """Error of orders 1 and 2 in green, the channel that every video keeps, when both are scaled to L~_0 = 1."""
    shown, known = (
        light[:, 1:2] / np.where(np.abs(light[0, 1]) > 0.0, light[0, 1].real, 1.0) for light in (found, truth)
    )
    return float(np.sqrt(np.mean(order_errors(shown, known, frequencies)[1:3] ** 2)))


def _relative(light: KnownLight, probe: Probe) -> Array:
    packed = light.packed(probe.frequencies)[:, 1]
    return np.asarray(packed / max(abs(packed[0]), 1e-12), float)


def _distance(shown: ComplexArray, light: KnownLight, probe: Probe) -> float:
    """Rms difference of orders 1 and 2, each relative to its L~_0."""
    other = unpack_real(_relative(light, probe))
    low = (frequency_order(probe.frequencies) > 0) & (frequency_order(probe.frequencies) <= 2)
    return float(np.sqrt(np.mean(np.abs(shown - other)[low] ** 2)))
