"""Calibration from known lighting: the paper's, for any number of lightings and for cameras that move.

The paper measures V in K x N, K blocks under N known lightings, and solves L = M V for one view (see
`estimation.fixed_estimator`). Here the known lights correct A(view) instead: the layers, and each block's gain, offset,
modulation and phase, with normal priors toward the model, so that N < K is enough and every view is served.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.block_corrections import KINDS, MODEL, CorrectionPrior, corrections_of
from arlight.calibration.known_lighting.checks import (
    LightingError,
    check_lights,
    check_match,
    condition_number,
    lighting_error,
)
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.known_lighting.lit_fit import KnownLightingFit, Normal
from arlight.calibration.known_lighting.lit_views import LitView, measure
from arlight.calibration.known_lighting.lit_weights import RowModel, white_level
from arlight.calibration.known_lighting.sheet_model import (
    EXPECTED,
    LAYER_STDDEV,
    NAMES,
    VIGNETTING,
    SheetModel,
    Unknowns,
)
from arlight.calibration.layers.layer_parameters import vector_of
from arlight.calibration.layers.view_measurement import SeenSheet
from arlight.camera import Camera
from arlight.fourier import frequency_order
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import field_blocks

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]
"""Called with steps done and steps in all."""

_APPROACH = ((1, 0.02), (2, 0.01), (3, 0.005), (8, 0.003))
"""Highest order and tolerance of the first steps, from layers that may lie a fine stripe's period aside."""
_PASSES = 2
"""Fits, each to frames measured with the film where the last one found it."""
_STEPS = 2
"""Steps of each."""
_STRAYED = 3.0
"""Prior standard deviations beyond which a block's correction is suspicious."""
_UNEXPLAINED = 4.0
"""Mean normalised square of a block's stripes, where errors are as assumed 1, beyond which they are not explained."""
_LEAST_CHI2 = 0.1


@dataclass(frozen=True, slots=True)
class DistrustedBlock:
    """A block that is not what the calibration's model can describe."""

    id: int
    """The block's number on the sheet."""
    reasons: tuple[str, ...]
    """Why."""


@dataclass(frozen=True, slots=True)
class KnownLightingCalibration:
    """What frames under known light told."""

    assembly: Assembly
    """The sheet as it is, with corrections of single blocks."""
    vignetting: tuple[float, float, float]
    """Radial gain of the camera's lens beside what its file already had."""
    values: dict[str, float]
    """Parameters of the layers by name."""
    stddev: dict[str, float]
    """Their standard deviations."""
    block_stddev: Array
    """(blocks, 4) standard deviations of the corrections: gain, offset, modulation, phase [deg]."""
    exposures: Array
    """(lightings, 3) factor on each environment's radiance; 1 where it is known."""
    condition: float
    """Condition number of the lights' coefficients."""
    errors: tuple[LightingError, ...]
    """How well each lighting is estimated by a calibration from the others."""
    distrusted: tuple[DistrustedBlock, ...]
    """Blocks that the model does not describe."""
    views: int
    """How many frames were used."""

    def camera(self, camera: Camera) -> Camera:
        """The camera with the vignetting that was found, on top of its own."""
        return camera.with_more_vignetting(self.vignetting)


def calibrate_known(
    seen: Sequence[SeenSheet],
    lights: Sequence[KnownLight],
    probe: Probe,
    camera: Camera,
    start: Assembly | None = None,
    vignetting: tuple[float, float, float] = (0.0, 0.0, 0.0),
    relative: bool = False,
    prior: CorrectionPrior | None = None,
    progress: Progress = lambda _done, _total: None,
) -> KnownLightingCalibration:
    """Estimate the assembled sheet from frames of it under known light.

    1. Layers by Gauss-Newton, coarse stripes first; blocks, poses and blurs with them, all with priors.
    2. Frames are measured again with the film where it was found, and fitted again.
    3. Every lighting in turn is left out, and estimated by what the others say.

    Args:
        seen: frames with the number of their light.
        lights: the lights by that number.
        probe: the sheet as designed.
        camera: the camera of all frames; vignetting is estimated beside what it has.
        start: an assembly near the truth, such as self-calibration gives.
        vignetting: of the lens beside what the camera has, found together with `start`.
        relative: leave the brightness of every light open, in each channel.
        prior: how far single blocks stray from the model.
        progress: told how far the work is.

    Returns:
        The calibration, whatever blocks it distrusts.

    Raises:
        CalibrationError: too few lightings, lights all alike, frames without the sheet, or environments that are not
            those of the frames.
    """
    check_lights(lights, seen, probe)
    chosen = sorted(seen, key=lambda frame: frame.light)
    rows = RowModel(_white(probe), _orders(probe))
    fit = KnownLightingFit(probe, lights, rows, prior or CorrectionPrior(), relative)
    approach = _APPROACH if start is None else _APPROACH[-1:]
    total = len(approach) + _PASSES * _STEPS + 1 + len(lights)
    unknowns = _first(chosen, len(lights), probe, start, vignetting)
    views = measure(chosen, lights, probe, camera, unknowns.assembly)
    if relative:
        unknowns = _with_exposures(unknowns, views, lights, probe)
    done = 0
    for highest, tolerance in approach:
        unknowns, _ = fit.step(unknowns, views, highest, tolerance)
        progress(done := done + 1, total)
    for _ in range(_PASSES):
        views = measure(chosen, lights, probe, camera, unknowns.assembly, _predicted(unknowns, views, lights, probe))
        for _ in range(_STEPS):
            unknowns, _ = fit.step(unknowns, views, probe.order, 0.0)
            fit.learn_prior(unknowns)
            progress(done := done + 1, total)
    normal = fit.normal(unknowns, views)
    progress(done := done + 1, total)
    errors = []
    for number, light in enumerate(lights):
        change, _ = normal.solve(without=number)
        without = fit.moved(unknowns, change)
        frames = [frame for frame in chosen if frame.light == number]
        lens = camera.with_more_vignetting((*without.vignetting, 0.0))
        errors.append(lighting_error(light, frames, probe, lens, without, unknowns.exposures[number]))
        progress(done := done + 1, total)
    check_match(errors, lights, probe, relative)
    return _result(unknowns, normal, views, errors, condition_number(lights, probe)[0], probe, fit.prior)


def _first(
    seen: Sequence[SeenSheet],
    lightings: int,
    probe: Probe,
    start: Assembly | None,
    vignetting: tuple[float, float, float],
) -> Unknowns:
    blocks = len(field_blocks(probe))
    layers = EXPECTED.copy()
    corrections = np.tile(MODEL, (blocks, 1))
    if start is not None:
        layers[:-1] = vector_of(start)
        layers[list(VIGNETTING)] = vignetting[:2]
        corrections = corrections_of(start, blocks)
    own = np.array([[frame.pose.blur_px**2, 0.0, 0.0, 0.0, 0.0] for frame in seen])
    return Unknowns(layers, corrections, own, np.ones((lightings, 3)))


def _with_exposures(unknowns: Unknowns, views: list[LitView], lights: Sequence[KnownLight], probe: Probe) -> Unknowns:
    """Exposures that give every light's frames their brightness."""
    white = _white(probe)
    model = SheetModel(probe, lights, unknowns)
    ratios: list[list[Array]] = [[] for _ in lights]
    for number, view in enumerate(views):
        predicted = model.predict(view, unknowns.views[number], np.ones(3)).rows
        pretended = replace(view, sheet=replace(view.sheet, means=replace(view.sheet.means, values=predicted)))
        ratios[view.sheet.light].append(white_level(view, white) / white_level(pretended, white))
    return replace(unknowns, exposures=np.array([np.median(own, axis=0) for own in ratios]))


def _predicted(unknowns: Unknowns, views: list[LitView], lights: Sequence[KnownLight], probe: Probe) -> list[Array]:
    model = SheetModel(probe, lights, unknowns)
    return [
        model.predict(view, own, unknowns.exposures[view.sheet.light]).rows
        for view, own in zip(views, unknowns.views, strict=True)
    ]


def _result(
    unknowns: Unknowns,
    normal: Normal,
    views: list[LitView],
    errors: list[LightingError],
    condition: float,
    probe: Probe,
    prior: CorrectionPrior,
) -> KnownLightingCalibration:
    _, covariance = normal.solve()
    # errors of codec and model repeat from view to view, so views do not average them
    chi2 = max(float(normal.squared.mean()), _LEAST_CHI2)
    deviation = np.sqrt(np.diagonal(covariance) * max(len(views) * chi2, 1.0))
    layers = np.minimum(deviation[: len(NAMES)], LAYER_STDDEV)
    blocks = np.minimum(deviation[-unknowns.blocks.size :].reshape(unknowns.blocks.shape), prior.stddev)
    return KnownLightingCalibration(
        assembly=unknowns.assembly,
        vignetting=(*unknowns.vignetting, 0.0),
        values=dict(zip(NAMES, map(float, unknowns.layers), strict=True)),
        stddev=dict(zip(NAMES, map(float, layers), strict=True)),
        block_stddev=blocks,
        exposures=unknowns.exposures,
        condition=condition,
        errors=tuple(errors),
        distrusted=_distrusted(unknowns.blocks, normal.squared, views, probe, prior),
        views=len(views),
    )


def _distrusted(
    corrections: Array, squared: Array, views: list[LitView], probe: Probe, prior: CorrectionPrior
) -> tuple[DistrustedBlock, ...]:
    strayed = (corrections - MODEL) / prior.stddev
    valid = np.array([view.sheet.means.valid for view in views])
    lightings = np.array([view.sheet.light for view in views])
    found = []
    for number, block in enumerate(field_blocks(probe)):
        reasons = [
            f"{kind} {corrections[number, place]:.3g} is {abs(strayed[number, place]):.1f} standard deviations from "
            "the model"
            for place, kind in enumerate(KINDS)
            if abs(strayed[number, place]) > _STRAYED
        ]
        under = len(set(lightings[valid[:, number]]))
        if under < 2:
            reasons.append(f"seen under {under} of the lightings")
        else:
            left = float(np.median(squared[valid[:, number], number]))
            if left > _UNEXPLAINED:
                reasons.append(f"its stripes stray {np.sqrt(left):.1f} times as far as noise")
        if reasons:
            found.append(DistrustedBlock(block.id, tuple(reasons)))
    return tuple(found)


def _white(probe: Probe) -> NDArray[np.bool_]:
    return np.array([block.kind == "clear_white" for block in field_blocks(probe)])


def _orders(probe: Probe) -> NDArray[np.int64]:
    return frequency_order(np.array([block.frequency or (0, 0) for block in field_blocks(probe)]))
