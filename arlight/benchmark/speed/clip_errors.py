"""How wrong pose, coefficients and relit pictures are on frames whose truth is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.benchmark.evaluation import order_error
from arlight.camera import Camera, Pose
from arlight.estimation.independent_parts import completed
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need
from arlight.fourier import frequency_order, pack_real
from arlight.probe.design import Probe
from arlight.rendering.relight import Relighter
from arlight.synthetic.truth import FrameTruth

Array = NDArray[np.float64]

_INSIDE = 0.99
"""Coverage from which a pixel shows nothing but the object."""


@dataclass(frozen=True, slots=True)
class CoefficientErrors:
    """Errors of the light's coefficients, median over the frames, relative to |L~_0|."""

    orders: tuple[float, ...]
    """Of each order, from 0."""
    together: float
    """Of orders 1 and up; of order 0 where there is no other."""


def pose_errors_px(poses: Sequence[Pose | None], truth: Sequence[FrameTruth], camera: Camera, probe: Probe) -> Array:
    """(frames,) rms distance of the sheet's corners from where they are [px]; nan where there is no pose."""
    return np.array(
        [
            np.nan if pose is None else _corner_distance_px(pose, true.pose, camera, probe)
            for pose, true in zip(poses, truth, strict=True)
        ]
    )


def _corner_distance_px(pose: Pose, true: Pose, camera: Camera, probe: Probe) -> float:
    away = camera.project(pose, probe.outline_mm) - camera.project(true, probe.outline_mm)
    return float(np.sqrt(np.mean(np.sum(away**2, axis=1))))


def rms(values: Array) -> float:
    """Root mean square of what is finite; inf where nothing is, which is as wrong as can be."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else float("inf")


def coefficient_errors(
    lightings: Sequence[Lighting | None], truth: Sequence[FrameTruth], probe: Probe
) -> CoefficientErrors:
    """Errors by order; what a lighting does not reach counts as estimated to be 0."""
    true = np.stack([frame.coefficients for frame in truth])
    estimated = np.stack([_all_coefficients(lighting, probe) for lighting in lightings])
    orders = frequency_order(probe.frequencies)
    each = [order_error(estimated, true, orders == order, int(order)).relative_to_l0 for order in np.unique(orders)]
    above = orders > 0 if orders.max() else orders == 0
    return CoefficientErrors(tuple(each), order_error(estimated, true, above, int(orders.max())).relative_to_l0)


def _all_coefficients(lighting: Lighting | None, probe: Probe) -> NDArray[np.complex128]:
    """(k, 3) of the sheet's own frequencies; nan without a lighting."""
    if lighting is None:
        return np.full((len(probe.frequencies), 3), np.nan + 0j)
    place = {tuple(frequency): k for k, frequency in enumerate(probe.frequencies.tolist())}
    coefficients = np.zeros((len(probe.frequencies), 3), complex)
    coefficients[[place[tuple(frequency)] for frequency in lighting.frequencies.tolist()]] = lighting.coefficients
    return coefficients


def true_lighting(like: Lighting, truth: FrameTruth, probe: Probe) -> Lighting:
    """The true light of a frame to the order of the sheet, as a relighter takes it."""
    count = 2 * len(probe.frequencies) - 1
    return replace(
        like,
        frequencies=probe.frequencies,
        coefficients=truth.coefficients,
        covariance=np.zeros((3, count, count)),
    )


def light_error(relighter: Relighter, lighting: Lighting, true: Lighting, pose: Pose) -> float:
    """Error of the object's picture that comes from the light alone.

    Args:
        relighter: draws the object, made for the order of both lightings.
        lighting: the estimate; true: the true light.
        pose: from where the object is seen.

    Returns:
        rms of the difference of linear light over the object's pixels, relative to the rms of the true picture; nan
        where the object is out of sight.
    """
    shown, reference = (relighter.draw_object(pose, light) for light in (lighting, true))
    if shown is None or reference is None:
        return float("nan")
    inside = reference[1][..., 3] > _INSIDE
    return relative_rms(shown[1][inside][:, :3], reference[1][inside][:, :3])


def need_error(need: Need, lighting: Lighting, truth: FrameTruth) -> float:
    """Error that comes from the light alone, of an object's picture and its shadow, averaged over views from above.

    Args:
        need: what of the light the object shows, for the order of the sheet.
        lighting: the estimate, of that order or less: as in drawing, what it leaves out is what it makes most probable.
        truth: the true light, to the order of the sheet.

    Returns:
        rms of the difference of linear light, relative to the rms of the true picture.
    """
    true, shown = pack_real(truth.coefficients), pack_real(lighting.coefficients)
    difference = completed(need.independent, shown) - true
    error, power = (float(np.sum(each * (need.shown @ each))) for each in (difference, true))
    return float(np.sqrt(error / power)) if power > 0.0 else float("nan")


def relative_rms(shown: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """rms of the difference, relative to the rms of the reference; nan without a pixel or without light."""
    power = float(np.mean(np.square(reference, dtype=float))) if reference.size else 0.0
    if not power > 0.0:
        return float("nan")
    return float(np.sqrt(np.mean(np.square(shown - reference, dtype=float)) / power))
